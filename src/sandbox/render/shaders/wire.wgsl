// Lines over a body: its triangles, or the edges of its tetrahedra.

#import bevy_pbr::mesh_view_bindings::view
#import pliant::studio::expose

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> color: vec4<f32>;

@vertex
fn vertex(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    var clip = view.clip_from_world * vec4<f32>(position, 1.0);
    // A hair nearer than the surface that the lines lie on (z is reversed).
    clip.z *= 1.002;
    return clip;
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    return vec4<f32>(expose(color.rgb, position.xy).rgb, color.a);
}
