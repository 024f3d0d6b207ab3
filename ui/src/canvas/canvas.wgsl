// One frame with its layer, composed in the gamma space of the window.
// Nothing here depends on the viewport: positions are physical pixels of the window.

struct Uniforms {
    // Physical pixels: left, top, width, height of the whole image.
    image: vec4<f32>,
    color_size: vec2<f32>,
    map_size: vec2<f32>,
    opacity: f32,
    entropy_scale: f32,
    // 0 colour, 1 labels, 2 entropy.
    layer: u32,
    entropy_row: u32,
    outline_strength: f32,
    // 1 where the window wants linear values.
    linear_target: u32,
    padding: vec2<u32>,
}

@group(0) @binding(0) var<uniform> u: Uniforms;
@group(0) @binding(1) var color_texture: texture_2d<f32>;
@group(0) @binding(2) var color_sampler: sampler;
@group(0) @binding(3) var label_texture: texture_2d<u32>;
@group(0) @binding(4) var entropy_texture: texture_2d<u32>;
@group(0) @binding(5) var palette: texture_2d<f32>;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    // One triangle that covers the viewport; the scissor rectangle cuts it.
    let corner = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4<f32>(2.0 * corner - 1.0, 0.0, 1.0);
}

fn sharp(position: vec2<f32>, pixels_per_texel: vec2<f32>) -> vec3<f32> {
    // Texels keep their edges when enlarged; the edge itself is one screen pixel wide.
    let seam = floor(position + 0.5);
    let offset = clamp((position - seam) * pixels_per_texel, vec2<f32>(-0.5), vec2<f32>(0.5));
    return textureSampleLevel(color_texture, color_sampler, (seam + offset) / u.color_size, 0.0).rgb;
}

fn image_color(uv: vec2<f32>) -> vec3<f32> {
    let pixels_per_texel = u.image.zw / u.color_size;
    let position = uv * u.color_size;
    if (pixels_per_texel.x >= 1.0) {
        return sharp(position, pixels_per_texel);
    }
    // Four samples a screen pixel when the image is made smaller.
    let quarter = 0.25 / u.image.zw;
    var sum = vec3<f32>(0.0);
    for (var i = 0u; i < 4u; i++) {
        let side = vec2<f32>(f32(i & 1u), f32(i >> 1u)) * 2.0 - 1.0;
        sum += textureSampleLevel(color_texture, color_sampler, uv + side * quarter, 0.0).rgb;
    }
    return 0.25 * sum;
}

fn texel_of(uv: vec2<f32>) -> vec2<i32> {
    let last = vec2<i32>(u.map_size) - 1;
    return clamp(vec2<i32>(floor(uv * u.map_size)), vec2<i32>(0), last);
}

fn label_at(uv: vec2<f32>) -> u32 {
    return textureLoad(label_texture, texel_of(uv), 0).r;
}

fn class_color(label: u32) -> vec4<f32> {
    if (label >= u.entropy_row * 256u) {
        return vec4<f32>(0.0);
    }
    return textureLoad(palette, vec2<i32>(vec2<u32>(label & 255u, label >> 8u)), 0);
}

fn entropy_color(uv: vec2<f32>) -> vec4<f32> {
    let steps = f32(textureLoad(entropy_texture, texel_of(uv), 0).r);
    let column = min(u32(steps * u.entropy_scale), 255u);
    return textureLoad(palette, vec2<i32>(vec2<u32>(column, u.entropy_row)), 0);
}

fn on_border(uv: vec2<f32>, label: u32) -> bool {
    let reach = 0.75 / u.image.zw;
    return label_at(uv + vec2<f32>(reach.x, 0.0)) != label
        || label_at(uv - vec2<f32>(reach.x, 0.0)) != label
        || label_at(uv + vec2<f32>(0.0, reach.y)) != label
        || label_at(uv - vec2<f32>(0.0, reach.y)) != label;
}

fn linear_from_gamma(value: vec3<f32>) -> vec3<f32> {
    let low = value / 12.92;
    let high = pow((value + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, low, value <= vec3<f32>(0.04045));
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let uv = (position.xy - u.image.xy) / u.image.zw;
    if (any(uv < vec2<f32>(0.0)) || any(uv >= vec2<f32>(1.0))) {
        discard;
    }
    var rgb = image_color(uv);
    if (u.layer == 1u && u.map_size.x > 0.0) {
        let label = label_at(uv);
        let over = class_color(label);
        rgb = mix(rgb, over.rgb, over.a * u.opacity);
        if (u.outline_strength > 0.0 && on_border(uv, label)) {
            rgb = mix(rgb, vec3<f32>(1.0), u.outline_strength);
        }
    } else if (u.layer == 2u && u.map_size.x > 0.0) {
        rgb = mix(rgb, entropy_color(uv).rgb, u.opacity);
    }
    if (u.linear_target == 1u) {
        rgb = linear_from_gamma(rgb);
    }
    return vec4<f32>(rgb, 1.0);
}
