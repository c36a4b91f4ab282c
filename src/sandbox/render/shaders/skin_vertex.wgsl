// Vertices of bodies and colliders, for the picture and for shadow maps. Grains are unit spheres that are
// scaled and moved here.

#ifdef PREPASS_PIPELINE
#import bevy_pbr::prepass_io::{Vertex, VertexOutput}
#else
#import bevy_pbr::forward_io::{Vertex, VertexOutput}
#endif
#import bevy_pbr::mesh_functions::{
    get_world_from_local, mesh_normal_local_to_world, mesh_position_local_to_world,
}
#import bevy_pbr::view_transformations::position_world_to_clip

#ifdef GRAINS
// Center of each grain [m] in xyz, and its radius [m] in w.
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var<storage, read> grains: array<vec4<f32>>;
#endif

@vertex
fn vertex(vertex: Vertex) -> VertexOutput {
    var position = vertex.position;
#ifdef GRAINS
    let grain = grains[u32(vertex.uv.x)];
    position = grain.xyz + grain.w * position;
#endif
    let world_from_local = get_world_from_local(vertex.instance_index);
    var out: VertexOutput;
    out.world_position = mesh_position_local_to_world(world_from_local, vec4<f32>(position, 1.0));
    out.position = position_world_to_clip(out.world_position.xyz);
#ifdef PREPASS_PIPELINE
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    out.unclipped_depth = out.position.z;
    // Casters in front of the near plane still cast their shadow.
    out.position.z = min(out.position.z, 1.0);
#endif
#else
    out.world_normal = mesh_normal_local_to_world(vertex.normal, vertex.instance_index);
#endif
#ifdef VERTEX_UVS_A
    out.uv = vertex.uv;
#endif
#ifdef VERTEX_UVS_B
    out.uv_b = vertex.uv_b;
#endif
#ifdef VERTEX_COLORS
    out.color = vertex.color;
#endif
#ifdef VERTEX_OUTPUT_INSTANCE_INDEX
    out.instance_index = vertex.instance_index;
#endif
    return out;
}
