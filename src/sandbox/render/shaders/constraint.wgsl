// Constraints in the colors of how they are solved: edges as strips that face the eye, and
// tetrahedra as solids with flat sides.

#import bevy_pbr::mesh_view_bindings::view
#import pliant::studio::{ambient, expose, key_direction, KEY}

struct Vertex {
    @location(0) position: vec3<f32>,
    // The other end of an edge.
    @location(1) other: vec3<f32>,
    // Linear sRGB; the last is the side of the strip, -1 or 1, and 0 for a corner of a solid.
    @location(5) color: vec4<f32>,
}

struct Drawn {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) @interpolate(flat) color: vec3<f32>,
    @location(2) @interpolate(flat) solid: f32,
}

// Width of a strip as a fraction of the height of the picture. The clip space is two units wide.
const WIDTH: f32 = 0.0022;

@vertex
fn vertex(in: Vertex) -> Drawn {
    var out: Drawn;
    out.world = in.position;
    out.color = in.color.rgb;
    out.solid = select(0.0, 1.0, in.color.a == 0.0);
    out.clip = view.clip_from_world * vec4<f32>(in.position, 1.0);
    if in.color.a != 0.0 {
        let other = view.clip_from_world * vec4<f32>(in.other, 1.0);
        let size = view.viewport.zw;
        let along = (other.xy / other.w - out.clip.xy / out.clip.w) * size;
        let across = normalize(vec2<f32>(-along.y, along.x) + vec2<f32>(1e-9, 0.0));
        out.clip += vec4<f32>(
            across * in.color.a * WIDTH * size.y / size * out.clip.w,
            0.0,
            0.0,
        );
    }
    return out;
}

@fragment
fn fragment(in: Drawn) -> @location(0) vec4<f32> {
    let side = cross(dpdx(in.world), dpdy(in.world));
    let towards = normalize(view.world_position - in.world);
    let normal = normalize(side + vec3<f32>(0.0, 1e-20, 0.0));
    let facing = select(-normal, normal, dot(normal, towards) > 0.0);
    let light = ambient(facing) + KEY * max(dot(facing, key_direction()), 0.0);
    let lit = mix(vec3<f32>(0.9), light, in.solid);
    return vec4<f32>(expose(in.color * lit, in.clip.xy).rgb, 1.0);
}
