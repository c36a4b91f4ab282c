// The reference overlay: a transparent surface, clear where it faces the eye and dense at its
// outline, like thin glass.

#import bevy_pbr::mesh_view_bindings::view
#import pliant::studio::expose

struct Veil {
    // Linear sRGB.
    color: vec3<f32>,
    // How far inside its body it is still seen [m].
    reach: f32,
    // 1 if the surface encloses a volume: its far side is left out then.
    closed: u32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> veil: Veil;

struct Vertex {
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

struct Drawn {
    @builtin(position) clip: vec4<f32>,
    @location(0) world: vec3<f32>,
    @location(1) normal: vec3<f32>,
}

// Opacity where it faces the eye, and at its outline.
const CLEAR: f32 = 0.14;
const DENSE: f32 = 0.85;

@vertex
fn vertex(in: Vertex) -> Drawn {
    var out: Drawn;
    out.world = in.position;
    out.normal = in.normal;
    out.clip = view.clip_from_world * vec4<f32>(in.position, 1.0);
    // Its depth is that of a point nearer to the eye, so that its own body does not hide it while
    // what stands before both does.
    let away = view.world_position - in.position;
    let distance = length(away);
    let nearer = in.position + away * (min(veil.reach, 0.8 * distance) / distance);
    let clip = view.clip_from_world * vec4<f32>(nearer, 1.0);
    out.clip.z = clip.z / clip.w * out.clip.w;
    return out;
}

@fragment
fn fragment(in: Drawn, @builtin(front_facing) is_front: bool) -> @location(0) vec4<f32> {
    if (!is_front && veil.closed == 1u) {
        discard;
    }
    let to_eye = normalize(view.world_position - in.world);
    let aslant = 1.0 - abs(dot(normalize(in.normal), to_eye));
    let opacity = mix(CLEAR, DENSE, aslant * aslant * aslant);
    return vec4<f32>(expose(veil.color, in.clip.xy).rgb, opacity);
}
