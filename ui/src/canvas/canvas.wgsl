// One frame with its layer, composed in the gamma space of the window.
// Nothing here depends on the viewport: positions are physical pixels of the window.

struct Uniforms {
    // Physical pixels: left, top, width, height of the whole image.
    image: vec4<f32>,
    // How much of the layer's colour there is.
    strength: f32,
    // A value times this is a column of its table.
    scale: f32,
    outline_strength: f32,
    hatching: f32,
    // 0 nothing, 1 classes, 2 values.
    reading: u32,
    // Row of the palette with the values' colours.
    table_row: u32,
    // Rows of the palette with classes.
    class_rows: u32,
    // The value of pixels without one; above all values where there is none.
    hole: u32,
    // Width of the stripes of such pixels, in texels.
    stripe: u32,
    // 1 where the image is dimmed to grey: what black becomes, and how much brightness stays.
    greyed: u32,
    dimmed: vec2<f32>,
    // 1 where the window wants linear values.
    linear_target: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> u: Uniforms;
@group(0) @binding(1) var color_texture: texture_2d<f32>;
@group(0) @binding(2) var color_sampler: sampler;
@group(0) @binding(3) var plane: texture_2d<u32>;
@group(0) @binding(4) var palette: texture_2d<f32>;

// What fragments branch on comes with the vertices: Mesa's software Vulkan compiles a shader anew, and
// keeps the old one, whenever a uniform is written that it branches on.
struct Corner {
    @builtin(position) position: vec4<f32>,
    // Width and height of the whole image in physical pixels.
    @location(0) @interpolate(flat) size: vec2<f32>,
    @location(1) @interpolate(flat) reading: u32,
    @location(2) @interpolate(flat) outlined: u32,
    @location(3) @interpolate(flat) greyed: u32,
    @location(4) @interpolate(flat) linear_target: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Corner {
    var corner: Corner;
    // One triangle that covers the viewport; the scissor rectangle cuts it.
    let place = vec2<f32>(f32((index << 1u) & 2u), f32(index & 2u));
    corner.position = vec4<f32>(2.0 * place - 1.0, 0.0, 1.0);
    corner.size = u.image.zw;
    corner.reading = u.reading;
    corner.outlined = u32(u.outline_strength > 0.0);
    corner.greyed = u.greyed;
    corner.linear_target = u.linear_target;
    return corner;
}

fn color_size() -> vec2<f32> {
    return vec2<f32>(textureDimensions(color_texture));
}

fn sharp(position: vec2<f32>, pixels_per_texel: vec2<f32>) -> vec3<f32> {
    // Texels keep their edges when enlarged; the edge itself is one screen pixel wide.
    let seam = floor(position + 0.5);
    let offset = clamp((position - seam) * pixels_per_texel, vec2<f32>(-0.5), vec2<f32>(0.5));
    return textureSampleLevel(color_texture, color_sampler, (seam + offset) / color_size(), 0.0).rgb;
}

fn image_color(uv: vec2<f32>, pixels_per_texel: vec2<f32>) -> vec3<f32> {
    let position = uv * color_size();
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
    let size = vec2<i32>(textureDimensions(plane));
    return clamp(vec2<i32>(floor(uv * vec2<f32>(size))), vec2<i32>(0), size - 1);
}

fn value_at(uv: vec2<f32>) -> u32 {
    return textureLoad(plane, texel_of(uv), 0).r;
}

fn class_color(id: u32) -> vec4<f32> {
    if (id >= u.class_rows * 256u) {
        return vec4<f32>(0.0);
    }
    return textureLoad(palette, vec2<i32>(vec2<u32>(id & 255u, id >> 8u)), 0);
}

fn value_color(value: u32) -> vec4<f32> {
    let column = min(u32(f32(value) * u.scale), 255u);
    return textureLoad(palette, vec2<i32>(vec2<u32>(column, u.table_row)), 0);
}

// Stripes along a diagonal of the plane, for pixels without a value.
fn hatched(uv: vec2<f32>) -> vec3<f32> {
    let texel = vec2<u32>(texel_of(uv));
    return vec3<f32>(1.0 - f32(((texel.x + texel.y) / u.stripe) & 1u));
}

fn on_border(uv: vec2<f32>, id: u32) -> bool {
    let reach = 0.75 / u.image.zw;
    return value_at(uv + vec2<f32>(reach.x, 0.0)) != id
        || value_at(uv - vec2<f32>(reach.x, 0.0)) != id
        || value_at(uv + vec2<f32>(0.0, reach.y)) != id
        || value_at(uv - vec2<f32>(0.0, reach.y)) != id;
}

fn dimmed(rgb: vec3<f32>) -> vec3<f32> {
    let brightness = dot(rgb, vec3<f32>(0.299, 0.587, 0.114));
    return vec3<f32>(u.dimmed.x + u.dimmed.y * brightness);
}

fn linear_from_gamma(value: vec3<f32>) -> vec3<f32> {
    let low = value / 12.92;
    let high = pow((value + 0.055) / 1.055, vec3<f32>(2.4));
    return select(high, low, value <= vec3<f32>(0.04045));
}

@fragment
fn fragment(corner: Corner) -> @location(0) vec4<f32> {
    let uv = (corner.position.xy - u.image.xy) / u.image.zw;
    if (any(uv < vec2<f32>(0.0)) || any(uv >= vec2<f32>(1.0))) {
        discard;
    }
    var rgb = image_color(uv, corner.size / color_size());
    if (corner.greyed == 1u) {
        rgb = dimmed(rgb);
    }
    if (corner.reading == 1u) {
        let id = value_at(uv);
        let over = class_color(id);
        rgb = mix(rgb, over.rgb, over.a * u.strength);
        if (corner.outlined == 1u && on_border(uv, id)) {
            rgb = mix(rgb, vec3<f32>(1.0), u.outline_strength);
        }
    } else if (corner.reading == 2u) {
        let value = value_at(uv);
        if (value == u.hole) {
            rgb = mix(rgb, hatched(uv), u.hatching);
        } else {
            let over = value_color(value);
            rgb = mix(rgb, over.rgb, over.a * u.strength);
        }
    }
    if (corner.linear_target == 1u) {
        rgb = linear_from_gamma(rgb);
    }
    return vec4<f32>(rgb, 1.0);
}
