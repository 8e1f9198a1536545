// What the eye sees of the lens's picture: bent as by a telescope, the round field with its notch, darker at its rim, and the
// veil of tissue that the lens is pressed on. A pass over the finished picture.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import resecta::noise::noise

// As `RoundField` in round_field.rs.
struct RoundField {
    area: vec4<f32>,
    drawn: vec2<f32>,
    place: vec3<f32>,
    radius: f32,
    right: vec3<f32>,
    roll: f32,
    up: vec3<f32>,
    veil: f32,
    ahead: vec3<f32>,
    barrel: f32,
    veils: vec4<f32>,
    beside: f32,
}

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(2) var<uniform> field: RoundField;

// Tissue lit from within, as a screen shows it: between vessels and over them.
const FLESH: vec3<f32> = vec3(0.60, 0.165, 0.125);
const FLESH_DARK: vec3<f32> = vec3(0.36, 0.060, 0.045);
// Distance at which the grain of pressed tissue is drawn, mm.
const PRESSED_MM: f32 = 1.2;
// How far the veil blurs, as a share of the field's radius.
const BLUR: f32 = 0.09;

fn texel(at: vec2<f32>) -> vec3<f32> {
    let last = field.area.xy + field.drawn - 1.0;
    return textureLoad(picture, vec2<i32>(clamp(at, field.area.xy, last)), 0).rgb;
}

// The pixel as which was drawn what belongs to a pixel that is shown.
fn as_drawn(shown: vec2<f32>) -> vec2<f32> {
    return field.area.xy + (shown - field.area.xy) * field.drawn / field.area.zw;
}

// The picture between its pixels.
fn between(at: vec2<f32>) -> vec3<f32> {
    let corner = floor(at - 0.5) + 0.5;
    let share = at - corner;
    let above = mix(texel(corner), texel(corner + vec2(1.0, 0.0)), share.x);
    let below = mix(texel(corner + vec2(0.0, 1.0)), texel(corner + vec2(1.0, 1.0)), share.x);
    return mix(above, below, share.y);
}

// The picture with soft edges, around a point of it.
fn blurred(at: vec2<f32>, radius: f32) -> vec3<f32> {
    var sum = 2.0 * texel(at);
    // The golden angle spreads few points evenly over a disc.
    for (var point = 0; point < 12; point++) {
        let angle = 2.399963 * f32(point);
        let far = sqrt((f32(point) + 0.5) / 12.0);
        sum += texel(at + radius * far * vec2(cos(angle), sin(angle)));
    }
    return sum / 14.0;
}

// How much tissue hides there: through what is known in the middle and at four points around it, curves of second order.
fn veil_at(off_middle: vec2<f32>) -> f32 {
    let place = clamp(off_middle * vec2(1.0, -1.0) / field.beside, vec2(-1.0), vec2(1.0));
    let before = vec2(field.veils.z, field.veils.y);
    let after = vec2(field.veils.w, field.veils.x);
    let slope = 0.5 * (after - before);
    let curve = 0.5 * (after + before) - field.veil;
    return clamp(field.veil + dot(place, slope + place * curve), 0.0, 1.0);
}

// What a lens sees that touches tissue: a red glow, brightest where the lamp is, with soft dark vessels.
fn flesh(off_middle: vec2<f32>, far: f32) -> vec3<f32> {
    let ray = field.ahead + field.right * off_middle.x - field.up * off_middle.y;
    let place = field.place + PRESSED_MM * ray;
    let grain = 0.7 * noise(place * 0.9).w + 0.3 * noise(place * 2.3).w;
    return mix(FLESH_DARK, FLESH, smoothstep(0.15, 0.85, grain)) * (1.0 - 0.45 * far * far);
}

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4<f32> {
    let at = in.position.xy;
    if any(at < field.area.xy) || any(at >= field.area.xy + field.area.zw) {
        return textureLoad(picture, vec2<i32>(at), 0);
    }
    // From the middle, as a share of the field's radius; y is down.
    let off_middle = (at - field.area.xy - 0.5 * field.area.zw) / field.radius;
    let far = length(off_middle);
    if far >= 1.0 {
        return vec4(0.0, 0.0, 0.0, 1.0);
    }

    // As `straight` in round_field.rs.
    let straight = off_middle * (1.0 - field.barrel + field.barrel * far * far);
    let there = as_drawn(at + (straight - off_middle) * field.radius);
    var colour = between(there);
    let veil = veil_at(straight);
    if veil > 0.0 {
        colour = mix(colour, blurred(there, BLUR * field.radius * veil * field.drawn.y / field.area.w), smoothstep(0.0, 0.3, veil));
        colour = mix(colour, flesh(straight, far), smoothstep(0.05, 0.95, veil));
    }
    // Lenses darken towards the edge.
    colour *= 1.0 - 0.40 * smoothstep(0.55, 0.98, far);
    colour *= 1.0 - smoothstep(0.975, 1.0, far);

    // A small notch that points inwards.
    let top = vec2(-sin(field.roll), -cos(field.roll));
    let inwards = 1.0 - dot(off_middle, top);
    let aside = abs(off_middle.x * top.y - off_middle.y * top.x);
    if inwards < 0.055 && aside < 0.6 * (0.055 - inwards) {
        colour = vec3(0.0);
    }
    return vec4(colour, 1.0);
}
