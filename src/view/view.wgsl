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

// As `Anatomy` in material.rs.
struct Anatomy {
    middle: vec4<f32>,
    verumontanum: vec4<f32>,
    neck: vec4<f32>,
    sphincter: vec4<f32>,
    bladder: vec4<f32>,
    orifices: array<vec4<f32>, 2>,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> look: Look;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var<uniform> anatomy: Anatomy;

const TISSUE: u32 = 0u;
const SECTION: u32 = 1u;
const SOLID: u32 = 2u;
const FLAT: u32 = 3u;
const WALL: u32 = 4u;
const CLOUD: u32 = 5u;

// As `MURK` in palette.rs.
const MURK: vec3<f32> = vec3(0.150, 0.012, 0.008);
// As the mucosa in palette.rs.
const URETHRA: vec3<f32> = vec3(0.66, 0.19, 0.15);
const BLOOD_ON_LENS: vec3<f32> = vec3(0.20, 0.008, 0.006);

// Tissue further from the lens than the second is sharp, nearer than the first as blurred as it gets, mm. Our choice: the floor of a narrow
// urethra, some 3 mm away, is to be seen. As alpha, which opaque surfaces have no other use for, it says to `round_field.wgsl` how sharp
// it is.
const FOCUS_MM: vec2<f32> = vec2(0.4, 2.6);

// 0, which no compiler can know. Mesa's lavapipe compiles a shader anew whenever a uniform value changes that alone decides a
// branch, and never frees it: 10 MB a frame here. With this in it, no uniform decides alone.
var<private> unknown: f32;

// Whether a uniform value that is 0 or well above is above 0.
fn is_set(value: f32) -> bool {
    return value + unknown > 0.01;
}

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

// 1 at 0, less further away.
fn bell(x: f32) -> f32 {
    return exp(-x * x);
}

// A line along the middle value of a noise, thinner than `width` (of the noise's own length), hardly wider where the noise is
// flat.
fn line(value: vec4<f32>, width: f32) -> f32 {
    let far = abs(value.w - 0.5) / (length(value.xyz) + 0.2);
    return 1.0 - smoothstep(0.3 * width, width + 0.001, far);
}

// What tissue is like at a place: its colour, how the surface rises (gradient, by place), how it shines.
struct Skin {
    colour: vec3<f32>,
    rise: vec3<f32>,
    gloss: f32,
}

// The direction of a place, at rest, from the middle line of the lumen. That line bends at the verumontanum, on its floor.
fn around_lumen(rest: vec3<f32>) -> vec2<f32> {
    let bend = anatomy.verumontanum.xyz - vec3(0.0, 2.8, 0.0);
    var end = anatomy.neck.xyz;
    if rest.z < bend.z {
        end = anatomy.sphincter.xyz;
    }
    let share = (rest.z - bend.z) / (end.z - bend.z);
    let across = rest.xy - mix(bend.xy, end.xy, share);
    return across / max(length(across), 0.3);
}

// Wall of the lumen and of the bladder: folds along the urethra, vessels, the ring of the neck, the landmarks. `far` is the way
// to the eye, mm.
fn mucosa(rest: vec3<f32>, colour: vec3<f32>, coarse: vec4<f32>, fine: vec4<f32>, far: f32) -> Skin {
    var skin = Skin(colour, coarse.xyz * 0.45 + fine.xyz * 0.35, 1.0);
    let above_neck = (rest.z - anatomy.neck.z) * anatomy.neck.w;
    // Of the bladder's colour from the neck on, along an uneven line.
    let vesical = smoothstep(-1.0, 2.5, above_neck + 3.0 * (coarse.w - 0.5)) * anatomy.neck.w;
    if vesical < 1.0 && is_set(anatomy.verumontanum.w) {
        let folds = noise(vec3(4.5 * around_lumen(rest), 0.13 * rest.z + 31.0));
        skin.rise += vec3(folds.xy, 0.0) * (0.9 * (1.0 - vesical));
        skin.colour *= mix(0.80 + 0.40 * folds.w, 1.0, vesical);
    }
    skin.colour *= mix(vec3(1.0), vec3(0.96, 1.22, 1.20), vesical);
    // The bladder's wall is paler in patches, smoother and duller: far away its sheen would turn all of it grey.
    if vesical > 0.0 {
        let patches = noise(rest * 0.13 + vec3(3.0, 11.0, 7.0));
        skin.colour *= mix(vec3(1.0), 0.82 + 0.36 * vec3(patches.w), vesical);
        skin.rise = mix(skin.rise, 0.6 * skin.rise + 2.4 * patches.xyz, vesical);
        skin.gloss *= 1.0 - 0.7 * vesical;
    }

    // Vessels under it, that taper and end, mostly along the urethra.
    let strong = smoothstep(0.40, 0.80, coarse.w);
    var vessel = 0.0;
    if strong > 0.0 {
        let stem = noise(rest * vec3(0.46, 0.46, 0.30) + coarse.xyz * 0.12);
        vessel = 0.55 * line(stem, 0.042 * strong);
    }
    if strong < 0.9 {
        let twig = noise(rest * vec3(1.3, 1.3, 0.8) + vec3(40.0, 0.0, 9.0) + fine.xyz * 0.06);
        vessel = max(vessel, 0.34 * line(twig, 0.070 * (0.9 - strong)));
    }
    // Those of the bladder are finer, and lost far away, where they would be thinner than a pixel.
    vessel *= mix(1.0, 0.9 / (1.0 + 0.0015 * far * far), vesical);
    skin.colour *= mix(vec3(1.0), vec3(0.70, 0.36, 0.38), vessel) * (0.88 + 0.24 * coarse.w);

    // The bladder neck: circular fibres raise it in narrow rings.
    if is_set(anatomy.neck.w) && abs(above_neck) < 5.0 {
        let ring = bell(above_neck / 2.0);
        skin.rise.z += 1.3 * ring * cos(7.0 * rest.z + 3.0 * coarse.w);
        skin.colour *= mix(vec3(1.0), vec3(1.04, 0.86, 0.84), ring);
    }
    // The external sphincter: the mucosa gathers in rings.
    let above_sphincter = rest.z - anatomy.sphincter.z;
    if is_set(anatomy.sphincter.w) && abs(above_sphincter) < 10.0 {
        let gathered = bell(above_sphincter / 4.0);
        skin.rise.z += 2.2 * gathered * cos(5.5 * rest.z + 2.0 * coarse.w);
        skin.colour *= mix(vec3(1.0), vec3(0.95, 0.78, 0.78), gathered);
    }
    // The verumontanum: smooth and pale, with the mouth of the utricle.
    let away = rest - anatomy.verumontanum.xyz;
    if is_set(anatomy.verumontanum.w) && dot(away, away) < 100.0 {
        let mound = bell(length(away * vec3(0.42, 0.30, 0.24)));
        skin.colour = mix(skin.colour, colour * vec3(1.22, 2.25, 1.75), 0.85 * mound);
        skin.rise *= 1.0 - 0.8 * mound;
        skin.gloss += 0.4 * mound;
        let mouth = length(vec2(away.x / 0.35, (away.z - 0.6) / 0.75));
        let open = step(abs(away.y), 2.5) * (1.0 - smoothstep(0.55, 1.1, mouth));
        skin.colour = mix(skin.colour, vec3(0.10, 0.015, 0.010), 0.9 * open);
    }
    return skin;
}

// The trigone on the bladder's wall: the ridge between the ureters' mouths, and these.
fn trigone(place: vec3<f32>, wall: Skin) -> Skin {
    var skin = wall;
    let centre = anatomy.bladder.xyz;
    let radius = anatomy.bladder.w;
    let out = normalize(place - centre);
    let left = normalize(anatomy.orifices[0].xyz - centre);
    let right = normalize(anatomy.orifices[1].xyz - centre);
    let ridge_normal = normalize(cross(left, right));
    let span = left - right;
    let along = normalize(span);
    let off = dot(out, ridge_normal) * radius;
    let share = dot(out - right, span) / dot(span, span);
    let ridge = bell(off / 2.2) * smoothstep(-0.15, 0.0, share) * (1.0 - smoothstep(1.0, 1.15, share));
    skin.rise -= ridge_normal * (3.0 * off * ridge);
    skin.colour *= mix(vec3(1.0), vec3(1.40, 1.85, 1.70), ridge);
    for (var side = 0; side < 2; side++) {
        let away = (out - select(right, left, side == 0)) * radius;
        // Slits, aslant towards the neck, with a pale lip.
        let slant = select(-0.5, 0.5, side == 0);
        let high = dot(away, ridge_normal);
        let wide = dot(away, along);
        let slit = vec2(wide + slant * high, high - slant * wide);
        let lip = bell(length(slit / vec2(2.6, 1.6)));
        let open = 1.0 - smoothstep(0.6, 1.1, length(slit / vec2(1.5, 0.45)));
        skin.colour = mix(skin.colour * (1.0 + 0.5 * lip), vec3(0.05, 0.008, 0.006), 0.95 * open);
    }
    return skin;
}

// Cut tissue: granular and a little shaggy, drawn out along the strokes; nearer to the capsule whitish fibres that run
// around the gland.
fn cut_face(rest: vec3<f32>, colour: vec3<f32>, fibrous: f32, coarse: vec4<f32>, fine: vec4<f32>) -> Skin {
    let shreds = noise(rest * vec3(3.1, 3.1, 0.9));
    var skin = Skin(colour, coarse.xyz * 0.45 + fine.xyz * 0.60 + shreds.xyz * 0.55, 1.0);
    // Pale nodules in darker stroma; ends of fibres that stand up.
    let nodule = smoothstep(0.25, 0.70, 0.6 * coarse.w + 0.4 * fine.w);
    let fringe = smoothstep(0.62, 0.80, shreds.w);
    skin.colour *= 0.62 + 0.30 * nodule + 0.22 * fine.w + 0.28 * fringe;
    let point = smoothstep(0.82, 0.92, noise(rest * 3.7 + vec3(3.0, 50.0, 1.0)).w);
    skin.colour = mix(skin.colour, vec3(0.36, 0.04, 0.03), 0.5 * point);
    if fibrous > 0.0 {
        let out = rest.xy - anatomy.middle.xy;
        let strands = noise(vec3(4.5 * out / max(length(out), 1.0), 2.1 * rest.z + 0.5 * coarse.w));
        let strand = smoothstep(0.40, 0.66, strands.w + 0.25 * (fine.w - 0.5));
        let woven = mix(colour * vec3(0.80, 0.70, 0.70), vec3(0.80, 0.66, 0.56), 0.8 * strand);
        skin.colour = mix(skin.colour, woven, fibrous);
        skin.rise = mix(skin.rise, vec3(0.15 * strands.xy, 1.3 * strands.z) + fine.xyz * 0.2, fibrous);
        skin.gloss += 0.5 * fibrous;
    }
    return skin;
}

// Tissue that current has dried: from tan to brown to charred, the deeper it lies in it (mm).
fn burn(skin: Skin, depth_mm: f32, fine: vec4<f32>) -> Skin {
    var burnt = skin;
    let heat = depth_mm + 0.6 * (fine.w - 0.5);
    let brown = smoothstep(0.55, 1.00, heat);
    let dried = smoothstep(0.15, 0.60, heat);
    let char = smoothstep(1.22, 1.42, heat);
    burnt.colour = mix(burnt.colour, vec3(0.420, 0.270, 0.130), 0.60 * dried);
    burnt.colour = mix(burnt.colour, vec3(0.190, 0.105, 0.050), 0.85 * brown);
    burnt.colour = mix(burnt.colour, vec3(0.016, 0.013, 0.012), 0.92 * char);
    burnt.gloss *= 1.0 - 0.5 * brown - 0.3 * char;
    burnt.rise += fine.xyz * (0.5 * brown + 0.8 * char);
    return burnt;
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    var out: FragmentOutput;
    var vertex = vec4(1.0);
#ifdef VERTEX_COLORS
    vertex = in.color;
#endif
    unknown = in.world_position.w - 1.0;
    let surface = look.surface + u32(abs(unknown));
    let eye = view.world_position;
    let place = in.world_position.xyz;
    let ray = normalize(place - eye);

    let forward = -view.world_from_view[2].xyz;
    if is_set(look.field_cos) && dot(ray, forward) < look.field_cos {
        out.color = vec4(0.0, 0.0, 0.0, 1.0);
        return out;
    }

    let is_cut_open = is_set(look.section.w);
    if is_cut_open && surface != SECTION {
        let side = select(-1.0, 1.0, eye.x >= look.section.x);
        if (place.x - look.section.x) * side > 0.0 {
            discard;
        }
    }

    if surface == FLAT {
        out.color = vec4(look.colour.rgb * vertex.rgb, look.colour.a * vertex.a);
        return out;
    }

#ifdef VERTEX_UVS_A
    if surface == CLOUD {
        let far = length(place - eye);
        let near = look.reach_mm / (look.reach_mm + far);
        let lit = mix(MURK, 1.25 * vertex.rgb * near * near, exp(-look.extinction * far)) * look.brightness;
        let soft = clamp(1.0 - dot(in.uv, in.uv), 0.0, 1.0);
        out.color = vec4(develop(mix(lit, BLOOD_ON_LENS, look.covered)), vertex.a * soft * soft);
        return out;
    }
#endif

    if surface == SECTION {
        out.color = vec4(develop(section_face(look.colour.rgb * vertex.rgb, eye, ray)), 1.0);
        return out;
    }

    if surface == TISSUE && !is_front && is_cut_open {
        out.color = vec4(develop(section_face(look.beyond.rgb, eye, ray)), 1.0);
        return out;
    }

    var normal = normalize(in.world_normal);
    normal = select(-normal, normal, dot(normal, ray) < 0.0 || (surface == TISSUE && is_front));
    // In creases what is between the vertices may face the eye where its normal looks away: as dark as a hole.
    normal = normalize(normal - ray * max(dot(normal, ray) + 0.15, 0.0));
    var colour = look.colour.rgb * vertex.rgb;
    var gloss = look.gloss;

    // Grain is of the tissue and moves with it.
    var rest = place;
    var coagulated_mm = 0.0;
#ifdef VERTEX_UVS_B
    if surface == TISSUE {
        rest = vec3(in.uv, in.uv_b.x);
        coagulated_mm = in.uv_b.y;
    }
#endif
    if is_set(look.relief) {
        let coarse = noise(rest * 0.75 + vec3(17.0, 5.0, 3.0));
        let fine = noise(rest * 2.3);
        var skin = Skin(colour, coarse.xyz * 0.55 + fine.xyz * 0.45, 1.0);
        if surface == TISSUE || surface == WALL {
            // From mucosa over adenoma and what lies outside of it to the capsule, as in palette.rs.
            var whole = smoothstep(0.68, 0.85, vertex.a);
            // At the gland's ends the urethra and the bladder go on.
            if surface == TISSUE && (rest.z < anatomy.middle.z || rest.z > anatomy.middle.w) {
                colour = mix(URETHRA, colour, whole);
                whole = 1.0;
            }
            if whole > 0.0 {
                skin = mucosa(rest, colour, coarse, fine, length(place - eye));
            }
            if whole < 1.0 {
                let fibrous = 1.0 - smoothstep(0.30, 0.50, vertex.a);
                let cut = cut_face(rest, colour, fibrous, coarse, fine);
                skin.colour = mix(cut.colour, skin.colour, whole);
                skin.rise = mix(cut.rise, skin.rise, whole);
                skin.gloss = mix(cut.gloss, skin.gloss, whole);
            }
            if coagulated_mm > 0.3 {
                skin = burn(skin, coagulated_mm, fine);
            }
            if surface == WALL && is_set(anatomy.orifices[0].w) && place.z > anatomy.neck.z {
                skin = trigone(place, skin);
            }
            skin.gloss *= 0.6 + 0.8 * fine.w;
        }
        colour = skin.colour;
        gloss *= skin.gloss;
        // Far away, what is finer than a pixel would glitter.
        let relief = look.relief / (1.0 + 0.002 * dot(place - eye, place - eye));
        normal = normalize(normal - relief * (skin.rise - normal * dot(skin.rise, normal)));
    }

    // The lamp is a little behind the lens, so that what nearly touches it does not burn out.
    let up = view.world_from_view[1].xyz;
    let distance = length(place - eye);
    var strength = look.brightness;
    var lamp = eye - forward * 3.0 + up * 1.2;
    if is_set(look.reach_mm) {
        let near = look.reach_mm / (look.reach_mm + distance);
        let beam = smoothstep(0.60, 0.95, dot(ray, forward));
        strength *= near * near * (0.45 + 0.55 * beam);
    } else {
        lamp = eye + up * distance * 0.55 - view.world_from_view[0].xyz * distance * 0.35;
    }
    let to_lamp = normalize(lamp - place);
    let facing = dot(normal, to_lamp);
    let is_wet = surface == TISSUE || surface == WALL;
    // Light that enters tissue comes out beside where it went in: shade is soft and red.
    let wrap = clamp((facing + 0.30) / 1.30, 0.0, 1.0);
    let direct = clamp(facing, 0.0, 1.0);
    let scatter = select(vec3(1.0), vec3(1.0, 0.72, 0.66), is_wet);
    var light = colour * strength * mix(vec3(direct), scatter * wrap, 0.75);
    light += colour * vec3(0.16, 0.10, 0.09) * strength;

    let half_way = normalize(to_lamp - ray);
    // Near the lens the sheen of a plain face would be a plain white patch: the film of water is uneven, and shines in glints more than
    // as a whole.
    if is_wet && distance < 16.0 && dot(normal, half_way) > 0.8 {
        let film = noise(rest * 3.1 + vec3(7.0, 23.0, 1.0)).xyz + 0.6 * noise(rest * 7.7).xyz;
        let near = 0.28 * (1.0 - smoothstep(7.0, 16.0, distance));
        normal = normalize(normal - near * (film - normal * dot(film, normal)));
    }
    let highlight = pow(clamp(dot(normal, half_way), 0.0, 1.0), look.sharpness);
    let edge = pow(1.0 - clamp(dot(normal, -ray), 0.0, 1.0), 4.0);
    let sheen = select(0.7, mix(0.2, 0.7, smoothstep(5.0, 16.0, distance)), is_wet);
    light += vec3(1.0, 0.96, 0.92) * gloss * min(strength, 0.9) * (highlight * sheen + edge * 0.08);
    // Water clings to tissue: small bright glints over the broad sheen.
    if is_wet {
        let glint = pow(clamp(dot(normal, half_way), 0.0, 1.0), 6.0 * look.sharpness);
        light += vec3(1.0, 0.97, 0.94) * gloss * min(strength, 0.9) * glint * 0.45;
    }
    light += look.colour.rgb * look.glow;
    // Blood in the water takes light away and sends some of the lamp's back; blood on the lens hides all.
    light = mix(MURK * look.brightness, light, exp(-look.extinction * distance));
    light = mix(light, BLOOD_ON_LENS, look.covered);

    var alpha = look.colour.a;
    if is_wet && is_set(look.field_cos) {
        alpha = smoothstep(FOCUS_MM.x, FOCUS_MM.y, distance);
    }
    out.color = vec4(develop(light), alpha);
    return out;
}
