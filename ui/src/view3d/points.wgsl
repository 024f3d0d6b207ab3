// Splats of a surface into a picture with depth, and that picture into the window.
// Colours are in the gamma space of the window.

struct Splats {
    clip_from_world: mat4x4<f32>,
    eye: vec3<f32>,
    // Radius of a splat in sides of its voxel.
    radius: f32,
    // Least radius, in metres for each metre of depth.
    least: f32,
    opacity: f32,
    entropy_scale: f32,
    // 0 colour, 1 labels or objects, 2 entropy.
    layer: u32,
    // Rows of the palette that hold classes.
    class_rows: u32,
    entropy_row: u32,
    // 1 where splats that face away are not drawn.
    see_through: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> u: Splats;
@group(0) @binding(1) var palette: texture_2d<f32>;

struct Splat {
    @location(0) position: vec3<f32>,
    @location(1) voxel: f32,
    @location(2) color: vec4<f32>,
    @location(3) normal: vec4<f32>,
    // Class, or value of an object, in the lower 16 bits, entropy in the upper ones.
    @location(4) value: u32,
}

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) place: vec2<f32>,
    @location(1) @interpolate(flat) color: vec3<f32>,
}

// What lies over the colour of a splat, and how much of it. Without a branch: Mesa's software Vulkan
// compiles a shader anew, and keeps the old one, whenever a uniform is written that it branches on.
fn over_color(value: u32) -> vec4<f32> {
    let label = value & 0xffffu;
    let entropy = min(u32(f32(value >> 16u) * u.entropy_scale), 255u);
    let shows_entropy = u.layer == 2u;
    let class_texel = vec2<u32>(label & 255u, label >> 8u);
    let texel = select(class_texel, vec2<u32>(entropy, u.entropy_row), shows_entropy);
    let over = textureLoad(palette, vec2<i32>(texel), 0);
    let is_class = label < u.class_rows * 256u;
    let is_seen = ((u.layer == 1u) & is_class) | shows_entropy;
    return vec4<f32>(over.rgb, select(0.0, u.opacity * over.a, is_seen));
}

@vertex
fn splat(@builtin(vertex_index) index: u32, own: Splat) -> Corner {
    var corner: Corner;
    let towards = u.eye - own.position;
    let has_normal = dot(own.normal.xyz, own.normal.xyz) > 0.25;
    let sight = normalize(towards);
    var normal = sight;
    if (has_normal) {
        normal = normalize(own.normal.xyz);
    }
    let other = select(vec3<f32>(0.0, 1.0, 0.0), vec3<f32>(1.0, 0.0, 0.0), abs(normal.y) > 0.9);
    let right = normalize(cross(normal, other));
    let down = cross(normal, right);
    let radius = max(own.voxel * u.radius, u.least * length(towards));
    let place = vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
    let position = u.clip_from_world
        * vec4<f32>(own.position + radius * (place.x * right + place.y * down), 1.0);
    let faces_away = has_normal & (dot(own.normal.xyz, towards) <= 0.0);
    // Before the near plane: clipped.
    let nowhere = vec4<f32>(0.0, 0.0, 2.0, 1.0);
    corner.position = select(position, nowhere, faces_away & (u.see_through == 1u));
    corner.place = place;

    let over = over_color(own.value);
    let rgb = mix(own.color.rgb, over.rgb, over.a);
    let light = 0.72 + 0.28 * abs(dot(normal, sight));
    corner.color = rgb * light;
    return corner;
}

@fragment
fn disc(corner: Corner) -> @location(0) vec4<f32> {
    if (dot(corner.place, corner.place) > 1.0) {
        discard;
    }
    return vec4<f32>(corner.color, 1.0);
}

struct Place {
    // Physical pixels of the window: left, top.
    origin: vec2<f32>,
    // 1 where the window wants linear values.
    linear_target: u32,
    padding: u32,
}

@group(0) @binding(2) var<uniform> place: Place;
@group(0) @binding(3) var picture: texture_2d<f32>;

@vertex
fn cover(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    // One triangle that covers the viewport; the scissor rectangle cuts it.
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4<f32>(2.0 * corner - 1.0, 0.0, 1.0);
}

fn linear_from_gamma(value: vec3<f32>) -> vec3<f32> {
    let low = value / 12.92;
    let high = pow((value + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, low, value <= vec3<f32>(0.04045));
}

@fragment
fn show(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let last = vec2<i32>(textureDimensions(picture)) - 1;
    let texel = clamp(vec2<i32>(floor(position.xy - place.origin)), vec2<i32>(0), last);
    var rgb = textureLoad(picture, texel, 0).rgb;
    if (place.linear_target == 1u) {
        rgb = linear_from_gamma(rgb);
    }
    return vec4<f32>(rgb, 1.0);
}
