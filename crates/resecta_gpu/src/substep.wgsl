// The substep of resecta_solver (motion.rs, kick.rs, springs.rs, held.rs), an invocation a node.
//
// An invocation gathers: it reads its neighbours' places of the substep before and writes its own new one elsewhere
// (`places_before`, `places`), so no two invocations write the same number and sums have one order, by slot. Every spring is
// computed at both of its ends; that costs arithmetic, of which there is plenty, and saves atomics, whose order would change
// from run to run.

struct Stretch {
    nodes: u32,
    // Length of a substep, s.
    substep_s: f32,
    // Bits of the largest sound component of a velocity, mm/s.
    fastest: u32,
    // Whether loads change with every substep.
    is_rising: u32,
    // Always 0, which no compiler can know.
    nothing: u32,
}

struct Found {
    // Bits of the largest square of a frequency, 1/s².
    largest_square: atomic<u32>,
    // 1 as soon as a velocity is not sound.
    unsound: atomic<u32>,
}

@group(0) @binding(0) var<uniform> stretch: Stretch;
// Slots before each slice of 64 nodes; one entry more than slices.
@group(0) @binding(1) var<storage, read> slices: array<u32>;
// By slot, 64 nodes each: the node at the other end, and stiffness (µN/mm) and rest length (mm).
@group(0) @binding(2) var<storage, read> neighbours: array<u32>;
@group(0) @binding(3) var<storage, read> springs: array<vec2<f32>>;
// Rest position, mm, and inverse inertia, 1/g.
@group(0) @binding(4) var<storage, read> rests: array<vec4<f32>>;
// By component, a number a node: velocity (mm/s), and what rounding took from the place (mm).
@group(0) @binding(5) var<storage, read_write> motion: array<f32>;
// By component, a number a node: load (µN), and what it gains with every substep.
@group(0) @binding(6) var<storage, read_write> loads: array<f32>;
@group(0) @binding(7) var<storage, read_write> found: Found;
// Place (mm), and stiffness of the bed (µN/mm), so that a node without one need not read where it rests.
@group(1) @binding(0) var<storage, read> places_before: array<vec4<f32>>;
@group(1) @binding(1) var<storage, read_write> places: array<vec4<f32>>;
// Factor left of the velocity, and velocity gained per force (s/g).
@group(2) @binding(0) var<storage, read> kicks: array<vec2<f32>>;

const SLICE: u32 = 64u;
// Shorter than this a spring counts as having no direction, mm.
const SHORTEST: f32 = 1e-9;

// Three numbers of a node, from component `first` on.
fn motion_of(node: u32, first: u32) -> vec3<f32> {
    let n = stretch.nodes;
    return vec3<f32>(motion[first * n + node], motion[(first + 1u) * n + node], motion[(first + 2u) * n + node]);
}

fn set_motion(node: u32, first: u32, value: vec3<f32>) {
    let n = stretch.nodes;
    motion[first * n + node] = value.x;
    motion[(first + 1u) * n + node] = value.y;
    motion[(first + 2u) * n + node] = value.z;
}

fn load_of(node: u32) -> vec3<f32> {
    let n = stretch.nodes;
    return vec3<f32>(loads[node], loads[n + node], loads[2u * n + node]);
}

fn raise_load(node: u32, load: vec3<f32>) {
    let n = stretch.nodes;
    loads[node] = load.x + loads[3u * n + node];
    loads[n + node] = load.y + loads[4u * n + node];
    loads[2u * n + node] = load.z + loads[5u * n + node];
}

// The same numbers, by a way that no compiler can see through: what comes out is not known to be the sum or difference that
// went in. WGSL lets a compiler reassociate and fuse: without this Mesa's software driver takes (a + b) - a for b, nothing is
// ever lost in its eyes, and slow nodes stand still.
fn opaque(value: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(value) ^ vec3<u32>(stretch.nothing));
}

fn force_of_bed(node: u32, place: vec4<f32>, sum: vec3<f32>) -> vec3<f32> {
    if place.w == 0.0 {
        return sum;
    }
    return fma(rests[node].xyz - place.xyz, vec3<f32>(place.w), sum);
}

fn pull(way: vec3<f32>, length: f32, spring: vec2<f32>) -> vec3<f32> {
    return way * (spring.x * (length - spring.y) / max(length, SHORTEST));
}

// Forces, a kick, a drift.
@compute @workgroup_size(64)
fn substep(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let node = id.x;
    if node >= stretch.nodes {
        return;
    }
    let place = places_before[node];
    let load = load_of(node);
    var force = load;
    let slice = node / SLICE;
    let end = slices[slice + 1u];
    for (var slot = slices[slice]; slot < end; slot++) {
        let at = slot * SLICE + lane;
        let way = places_before[neighbours[at]].xyz - place.xyz;
        force += pull(way, sqrt(dot(way, way)), springs[at]);
    }
    force = force_of_bed(node, place, force);

    let kick = kicks[node];
    let velocity = fma(motion_of(node, 0u), vec3<f32>(kick.x), force * kick.y);
    // Compensated: `lost` is what rounding took from the place, and is made good with the next step.
    let step = opaque(velocity * stretch.substep_s - motion_of(node, 3u));
    let after = opaque(place.xyz + step);
    let made = opaque(after - place.xyz);
    set_motion(node, 0u, velocity);
    set_motion(node, 3u, made - step);
    places[node] = vec4<f32>(after, place.w);
    if stretch.is_rising != 0u {
        raise_load(node, load);
    }
}

var<workgroup> largest_square: atomic<u32>;
var<workgroup> unsound: atomic<u32>;

// The forces at the end, the half kick that ends the last substep, and what follows for the next: how stiffly nodes are held
// and whether velocities are sound.
@compute @workgroup_size(64)
fn finish(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    let node = id.x;
    if node < stretch.nodes {
        let place = places_before[node];
        var force = load_of(node);
        // Tensors by which springs hold the node: xx, yy, zz and yz, xz, xy.
        var diagonal = vec3<f32>();
        var across = vec3<f32>();
        let slice = node / SLICE;
        let end = slices[slice + 1u];
        for (var slot = slices[slice]; slot < end; slot++) {
            let at = slot * SLICE + lane;
            let spring = springs[at];
            let way = places_before[neighbours[at]].xyz - place.xyz;
            let square = dot(way, way);
            let length = sqrt(square);
            force += pull(way, length, spring);
            // A spring without length may turn any way: it counts in all.
            var stretched = 1.0;
            if length > SHORTEST {
                stretched = max(1.0 - spring.y / length, 0.0);
            }
            let along = way * (spring.x * (1.0 - stretched) / max(square, SHORTEST * SHORTEST));
            diagonal += fma(along, way, vec3<f32>(spring.x * stretched));
            across += along.yxx * way.zzy;
        }
        force = force_of_bed(node, place, force);
        let kick = kicks[node];
        let velocity = fma(motion_of(node, 0u), vec3<f32>(kick.x), force * kick.y);
        set_motion(node, 0u, velocity);

        let stiffness = fma(2.0, largest_eigenvalue(diagonal, across), place.w);
        // By bits, as of numbers above 0: a compiler may take it that there is no NaN, but the bits of one are larger.
        let square = bitcast<u32>(stiffness * rests[node].w) & 0x7fffffffu;
        let speed = bitcast<vec3<u32>>(velocity) & vec3<u32>(0x7fffffffu);
        atomicMax(&largest_square, square);
        if any(speed > vec3<u32>(stretch.fastest)) {
            atomicOr(&unsound, 1u);
        }
    }
    workgroupBarrier();
    if lane == 0u {
        atomicMax(&found.largest_square, atomicLoad(&largest_square));
        atomicOr(&found.unsound, atomicLoad(&unsound));
    }
}

// An upper bound of the largest eigenvalue of a symmetric tensor: the formula of held.rs, with its reasons.
fn largest_eigenvalue(diagonal: vec3<f32>, across: vec3<f32>) -> f32 {
    const SLOPE: f32 = 0.5773503;
    let q = (diagonal.x + diagonal.y + diagonal.z) * (1.0 / 3.0);
    let unit = 1.0 / max(q, 1e-37);
    let relative = (diagonal - q) * unit;
    let off = across * unit;
    let p = sqrt((dot(relative, relative) + 2.0 * dot(off, off)) * (1.0 / 6.0));
    let scale = 1.0 / max(p, 1e-6);
    let d = relative * scale;
    let o = off * scale;
    let determinant = d.x * (d.y * d.z - o.x * o.x) - o.z * (o.z * d.z - o.x * o.y) + o.y * (o.z * o.x - d.y * o.y);
    let x = sqrt(clamp(fma(0.25, determinant, 0.5), 0.0, 1.0));
    let cosine = fma(x, fma(0.5 - SLOPE, x, SLOPE), 0.5);
    return q * fma(2.0 * p, cosine, 1.0);
}
