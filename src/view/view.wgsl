// The one shader of the views. The light is at the viewer: the endoscope's lamp sits beside its lens, and the outside view
// is lit from over the shoulder.

#import bevy_pbr::{
    forward_io::{VertexOutput, FragmentOutput},
    mesh_view_bindings::view,
}
#import resecta::noise::noise

// As `Look` in material.rs.
struct Look {
    colour: vec4<f32>,
    beyond: vec4<f32>,
    section: vec4<f32>,
    gloss: f32,
    sharpness: f32,
    relief: f32,
    glow: f32,
    reach_mm: f32,
    brightness: f32,
    field_cos: f32,
    surface: u32,
    extinction: f32,
    covered: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> look: Look;

const TISSUE: u32 = 0u;
const SECTION: u32 = 1u;
const SOLID: u32 = 2u;
const FLAT: u32 = 3u;

// As `MURK` in palette.rs.
const MURK: vec3<f32> = vec3(0.150, 0.012, 0.008);
const BLOOD_ON_LENS: vec3<f32> = vec3(0.20, 0.008, 0.006);

// From light to what a screen shows: the film curve of Narkowicz's fit.
fn develop(light: vec3<f32>) -> vec3<f32> {
    let x = max(light, vec3(0.0));
    return clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), vec3(0.0), vec3(1.0));
}

// The cut face of the section: evenly lit, with the grain of tissue.
fn section_face(colour: vec3<f32>, eye: vec3<f32>, ray: vec3<f32>) -> vec3<f32> {
    let across = select(ray.x, 1e-4, abs(ray.x) < 1e-4);
    let place = eye + ray * ((look.section.x - eye.x) / across);
    let grain = noise(place * vec3(0.6, 0.6, 0.35)).w * 0.6 + noise(place * 1.7).w * 0.4;
    return colour * (0.62 + 0.5 * grain) * look.brightness;
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    var out: FragmentOutput;
    var vertex = vec4(1.0);
#ifdef VERTEX_COLORS
    vertex = in.color;
#endif
    let eye = view.world_position;
    let place = in.world_position.xyz;
    let ray = normalize(place - eye);

    let forward = -view.world_from_view[2].xyz;
    if look.field_cos > 0.0 && dot(ray, forward) < look.field_cos {
        out.color = vec4(0.0, 0.0, 0.0, 1.0);
        return out;
    }

    let is_cut_open = look.section.w > 0.5;
    if is_cut_open && look.surface != SECTION {
        let side = select(-1.0, 1.0, eye.x >= look.section.x);
        if (place.x - look.section.x) * side > 0.0 {
            discard;
        }
    }

    if look.surface == FLAT {
        out.color = vec4(look.colour.rgb * vertex.rgb, look.colour.a * vertex.a);
        return out;
    }

    if look.surface == SECTION {
        out.color = vec4(develop(section_face(look.colour.rgb * vertex.rgb, eye, ray)), 1.0);
        return out;
    }

    if look.surface == TISSUE && !is_front && is_cut_open {
        out.color = vec4(develop(section_face(look.beyond.rgb, eye, ray)), 1.0);
        return out;
    }

    var normal = normalize(in.world_normal);
    normal = select(-normal, normal, dot(normal, ray) < 0.0 || (look.surface == TISSUE && is_front));
    var colour = look.colour.rgb * vertex.rgb;
    var gloss = look.gloss;

    if look.relief > 0.0 {
        let coarse = noise(place * 0.75 + vec3(17.0, 5.0, 3.0));
        let fine = noise(place * 2.3);
        let bump = coarse.xyz * 0.55 + fine.xyz * 0.45;
        normal = normalize(normal - look.relief * (bump - normal * dot(bump, normal)));
        if look.surface == TISSUE {
            // 1 on mucosa and capsule, 0 on cut tissue.
            let whole = smoothstep(0.55, 0.72, vertex.a);
            var mucosa = colour;
            if whole > 0.0 {
                // Vessels under the mucosa: thin lines along the middle values of a noise.
                let stem = abs(noise(place * 0.42 + bump * 0.25).w - 0.5);
                let twig = abs(noise(place * 1.05 + vec3(40.0, 0.0, 9.0)).w - 0.5);
                let vessel = max(1.0 - smoothstep(0.0, 0.035, stem), 0.6 * (1.0 - smoothstep(0.0, 0.04, twig)));
                mucosa = mix(colour, colour * vec3(0.62, 0.22, 0.24), 0.6 * vessel) * (0.86 + 0.28 * coarse.w);
            }
            var cut = colour;
            if whole < 1.0 {
                // Cut tissue: grooves along the strokes, granules, and bleeding points no wider than a vessel's mouth.
                let groove = noise(place * vec3(3.1, 3.1, 0.8));
                normal = normalize(normal - 0.3 * look.relief * (groove.xyz - normal * dot(groove.xyz, normal)));
                let point = smoothstep(0.80, 0.88, noise(place * 2.1 + vec3(3.0, 50.0, 1.0)).w);
                let grain = 0.66 + 0.34 * groove.w + 0.30 * fine.w;
                cut = mix(colour * grain, vec3(0.34, 0.03, 0.02), 0.6 * point);
            }
            colour = mix(cut, mucosa, whole);
            gloss = gloss * (0.6 + 0.8 * fine.w);
        }
    }

    // The lamp is a little behind the lens, so that what nearly touches it does not burn out.
    let up = view.world_from_view[1].xyz;
    let distance = length(place - eye);
    var strength = look.brightness;
    var lamp = eye - forward * 3.0 + up * 1.2;
    if look.reach_mm > 0.0 {
        let near = look.reach_mm / (look.reach_mm + distance);
        let beam = smoothstep(0.60, 0.95, dot(ray, forward));
        strength *= near * near * (0.45 + 0.55 * beam);
    } else {
        lamp = eye + up * distance * 0.55 - view.world_from_view[0].xyz * distance * 0.35;
    }
    let to_lamp = normalize(lamp - place);
    let facing = dot(normal, to_lamp);
    // Light that enters tissue comes out beside where it went in: shade is soft and red.
    let wrap = clamp((facing + 0.30) / 1.30, 0.0, 1.0);
    let direct = clamp(facing, 0.0, 1.0);
    let scatter = select(vec3(1.0), vec3(1.0, 0.72, 0.66), look.surface == TISSUE);
    var light = colour * strength * mix(vec3(direct), scatter * wrap, 0.75);
    light += colour * vec3(0.16, 0.10, 0.09) * strength;

    let half_way = normalize(to_lamp - ray);
    let highlight = pow(clamp(dot(normal, half_way), 0.0, 1.0), look.sharpness);
    let edge = pow(1.0 - clamp(dot(normal, -ray), 0.0, 1.0), 4.0);
    light += vec3(1.0, 0.96, 0.92) * gloss * min(strength, 0.9) * (highlight * 0.7 + edge * 0.08);
    // Water clings to tissue: small bright glints over the broad sheen.
    if look.surface == TISSUE {
        let glint = pow(clamp(dot(normal, half_way), 0.0, 1.0), 6.0 * look.sharpness);
        light += vec3(1.0, 0.97, 0.94) * gloss * min(strength, 0.9) * glint * 0.45;
    }
    light += look.colour.rgb * look.glow;
    // Blood in the water takes light away and sends some of the lamp's back; blood on the lens hides all.
    light = mix(MURK * look.brightness, light, exp(-look.extinction * distance));
    light = mix(light, BLOOD_ON_LENS, look.covered);

    out.color = vec4(develop(light), look.colour.a);
    return out;
}
