// Noise that all shaders here share.

#define_import_path resecta::noise

// A number from 0 to 1 for each point of the grid of integers.
fn hash(p: vec3<i32>) -> f32 {
    var h = bitcast<u32>(p.x) * 0x8da6b343u ^ bitcast<u32>(p.y) * 0xd8163841u ^ bitcast<u32>(p.z) * 0xcb1ab31fu;
    h = (h ^ (h >> 13u)) * 0x9e3779b1u;
    h = h ^ (h >> 16u);
    return f32(h & 0xffffffu) / 16777215.0;
}

// Smooth noise from 0 to 1 (w) and its gradient (xyz).
fn noise(p: vec3<f32>) -> vec4<f32> {
    let cell = vec3<i32>(floor(p));
    let f = fract(p);
    let u = f * f * (3.0 - 2.0 * f);
    let du = 6.0 * f * (1.0 - f);
    let a = hash(cell);
    let b = hash(cell + vec3(1, 0, 0));
    let c = hash(cell + vec3(0, 1, 0));
    let d = hash(cell + vec3(1, 1, 0));
    let e = hash(cell + vec3(0, 0, 1));
    let g = hash(cell + vec3(1, 0, 1));
    let h = hash(cell + vec3(0, 1, 1));
    let i = hash(cell + vec3(1, 1, 1));
    let k1 = b - a;
    let k2 = c - a;
    let k3 = e - a;
    let k4 = a - b - c + d;
    let k5 = a - c - e + h;
    let k6 = a - b - e + g;
    let k7 = -a + b + c - d + e - g - h + i;
    let value = a + k1 * u.x + k2 * u.y + k3 * u.z + k4 * u.x * u.y + k5 * u.y * u.z + k6 * u.z * u.x
        + k7 * u.x * u.y * u.z;
    let gradient = du * vec3(
        k1 + k4 * u.y + k6 * u.z + k7 * u.y * u.z,
        k2 + k5 * u.z + k4 * u.x + k7 * u.z * u.x,
        k3 + k6 * u.x + k5 * u.y + k7 * u.x * u.y,
    );
    return vec4(gradient, value);
}
