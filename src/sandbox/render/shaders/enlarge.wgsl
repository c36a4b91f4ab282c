// Enlarges a picture, whose values are sRGB.

#import bevy_core_pipeline::fullscreen_vertex_shader::FullscreenVertexOutput
#import pliant::srgb::linear

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var smooth_sampler: sampler;

@fragment
fn fragment(in: FullscreenVertexOutput) -> @location(0) vec4<f32> {
    return vec4<f32>(linear(textureSampleLevel(picture, smooth_sampler, in.uv, 0.0).rgb), 1.0);
}
