// What the eye sees of the lens's picture: bent as by a telescope, the round field with its notch, darker at its rim, what nearly touches
// the lens out of focus, and the veil of tissue that it is pressed on. A pass over the finished picture.

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
// How far what touches the lens is out of focus, as a share of the field's radius.
const OUT_OF_FOCUS: f32 = 0.10;
// Where such a blur is looked for, and what it is made of: points on a disc.
const LOOKED_AT: i32 = 8;
const POINTS: i32 = 28;
// A turn by the golden angle. A processor that draws computes no sine for every point of every pixel.
const GOLDEN: mat2x2<f32> = mat2x2<f32>(-0.7373688, 0.6754903, -0.6754903, -0.7373688);

// Colour, and how sharp it is: 1 is in focus (`view.wgsl`).
fn texel(at: vec2<f32>) -> vec4<f32> {
    let last = field.area.xy + field.drawn - 1.0;
    return textureLoad(picture, vec2<i32>(clamp(at, field.area.xy, last)), 0);
}

// How far out a point of a disc is, when each is turned from the last by the golden angle: that spreads few points evenly.
fn outwards(point: i32, points: i32) -> f32 {
    return sqrt((f32(point) + 0.5) / f32(points));
}

// The pixel as which was drawn what belongs to a pixel that is shown.
fn as_drawn(shown: vec2<f32>) -> vec2<f32> {
    return field.area.xy + (shown - field.area.xy) * field.drawn / field.area.zw;
}

// The picture between its pixels.
fn between(at: vec2<f32>) -> vec4<f32> {
    let corner = floor(at - 0.5) + 0.5;
    let share = at - corner;
    let above = mix(texel(corner), texel(corner + vec2(1.0, 0.0)), share.x);
    let below = mix(texel(corner + vec2(0.0, 1.0)), texel(corner + vec2(1.0, 1.0)), share.x);
    return mix(above, below, share.y);
}

// The picture around a point of it with what lies too near to the lens out of focus: that spreads over what is behind it, and lets it
// through at its edges. Behind a veil all is. `wide` is how far it spreads at most, pixels.
fn focused(at: vec2<f32>, here: vec4<f32>, veil: f32, wide: f32) -> vec3<f32> {
    let sharp = min(here.a, 1.0 - veil);
    var most = 1.0 - sharp;
    var way = vec2(1.0, 0.0);
    for (var point = 0; point < LOOKED_AT; point++) {
        most = max(most, 1.0 - texel(at + wide * outwards(point, LOOKED_AT) * way).a);
        way = GOLDEN * way;
    }
    if most < 0.03 {
        return here.rgb;
    }
    // Every pixel has its points turned in its own way (Jimenez's interleaved gradient noise): what few points leave of an edge is grain, not
    // copies of it.
    let turn = 6.2831853 * fract(52.9829189 * fract(dot(floor(at), vec2(0.06711056, 0.00583715))));
    way = vec2(cos(turn), sin(turn));
    var near = vec4(0.0);
    var behind = vec4(0.0);
    for (var point = 0; point < POINTS; point++) {
        let far = most * outwards(point, POINTS);
        let there = texel(at + wide * far * way);
        way = GOLDEN * way;
        let blur = max(1.0 - there.a, veil);
        // It spreads as far as it is blurred.
        let spread = 1.0 - smoothstep(0.8 * blur, 1.2 * blur + 0.01, far);
        near += spread * vec4(there.rgb, 1.0);
        behind += (1.0 - spread) * vec4(there.rgb, 1.0);
    }
    let through = mix(behind.rgb / max(behind.w, 0.01), here.rgb, sharp);
    return mix(through, near.rgb / max(near.w, 0.01), near.w / f32(POINTS));
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
    let as_pixels = field.radius * field.drawn.y / field.area.w;
    let veil = veil_at(straight);
    var colour = focused(there, between(there), veil, OUT_OF_FOCUS * as_pixels);
    if veil > 0.0 {
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
