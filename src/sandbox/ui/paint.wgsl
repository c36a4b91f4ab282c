// Paints the triangles of egui, as the shader of `bevy_egui` does but without its powers, which took
// a software renderer longer than the bodies.

#import pliant::srgb::linear

struct Transform {
    scale: vec2<f32>,
    translation: vec2<f32>,
}

struct Vertex {
    @location(0) position: vec2<f32>,
    @location(1) uv: vec2<f32>,
    // Premultiplied sRGB.
    @location(2) color: vec4<f32>,
}

struct Painted {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec4<f32>,
    @location(1) uv: vec2<f32>,
}

@group(0) @binding(0) var<uniform> transform: Transform;
@group(1) @binding(0) var image: texture_2d<f32>;
@group(1) @binding(1) var image_sampler: sampler;

@vertex
fn vs_main(in: Vertex) -> Painted {
    let position = in.position * transform.scale + transform.translation;
    return Painted(vec4<f32>(position, 0.0, 1.0), in.color, in.uv);
}

// The textures hold sRGB, as the colors do. egui multiplies the two.
@fragment
fn fs_main(in: Painted) -> @location(0) vec4<f32> {
    let texel = textureSampleLevel(image, image_sampler, in.uv, 0.0);
    return vec4<f32>(linear(in.color.rgb * texel.rgb), in.color.a * texel.a);
}
