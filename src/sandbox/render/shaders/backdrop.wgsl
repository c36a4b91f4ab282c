// The calm gradient behind everything: one triangle at infinite distance.

#import bevy_pbr::mesh_view_bindings::view
#import pliant::studio::{backdrop, expose}

struct Output {
    @builtin(position) position: vec4<f32>,
    @location(0) direction: vec3<f32>,
}

@vertex
fn vertex(@location(0) position: vec3<f32>) -> Output {
    // Depth 0 is infinity with reversed z: everything else is in front.
    let far = view.world_from_clip * vec4<f32>(position.xy, 1e-4, 1.0);
    return Output(vec4<f32>(position.xy, 0.0, 1.0), far.xyz / far.w - view.world_position);
}

@fragment
fn fragment(in: Output) -> @location(0) vec4<f32> {
    return expose(backdrop(normalize(in.direction)), in.position.xy);
}
