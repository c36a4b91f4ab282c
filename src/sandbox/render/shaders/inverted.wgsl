// Inverted tetrahedra in one color, in front of everything.

#import bevy_pbr::mesh_view_bindings::view

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> color: vec4<f32>;

@vertex
fn vertex(@location(0) position: vec3<f32>) -> @builtin(position) vec4<f32> {
    var clip = view.clip_from_world * vec4<f32>(position, 1.0);
    // Into the nearest hundredth of the depth (z is reversed), so that no body hides them.
    clip.z = 0.99 * clip.w + 0.01 * clip.z;
    return clip;
}

@fragment
fn fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    return color;
}
