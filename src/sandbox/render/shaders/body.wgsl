// Soft bodies and colliders: a translucent, glossy skin.
//
// Diffuse light wraps around the terminator as it does in a jelly, light from behind
// shines through, and a mirror-like coat shows the soft boxes of the studio.

#import bevy_pbr::forward_io::VertexOutput
#import bevy_pbr::mesh_view_bindings::view
#import pliant::studio::{
    KEY, ambient, backdrop, expose, key_direction, key_visibility, reflection,
}

struct Finish {
    // Linear sRGB, of the surface and of light that went through.
    color: vec3<f32>,
    // Perceptual roughness of the coat, 0 is a mirror.
    roughness: f32,
    // How far light travels inside: 0 is plaster, 1 is jelly.
    translucency: f32,
    // Strength of the coat's reflection, 0 is matt.
    gloss: f32,
    // 1 while the pointer is over the body or holds it.
    highlight: f32,
    // Height of the floor [m], for the shade near it.
    floor: f32,
    deep: vec3<f32>,
    // Opacity where the surface faces the eye; 1 except for glass.
    opacity: f32,
    // Colors of values, linear sRGB, evenly spaced from 0 to 1.
    map: array<vec4<f32>, 11>,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> finish: Finish;

// Minimum cosine between a normal and the direction to the eye.
const GRAZING: f32 = 0.12;

#ifdef VERTEX_UVS_B
// The color of a value that is at a place of the color map and at a place of the range, each from 0
// to 1. A value beyond the range is striped, one that is not defined gray.
fn value_color(value: vec2<f32>, frag_coord: vec2<f32>) -> vec3<f32> {
    if (value.x < -100.0) {
        return vec3<f32>(0.32);
    }
    let place = saturate(value.x) * 10.0;
    let first = min(u32(place), 9u);
    let color = mix(finish.map[first].rgb, finish.map[first + 1u].rgb, place - f32(first));
    let is_light = dot(color, vec3<f32>(0.2126, 0.7152, 0.0722)) > 0.25;
    let stripe = select(vec3<f32>(1.0), vec3<f32>(0.0), is_light);
    let is_stripe = fract((frag_coord.x + frag_coord.y) / 9.0) < 0.3;
    // Rounding of a value at an end of the range does not count.
    let is_beyond = value.y > 1.0001 || value.y < -0.0001;
    return select(color, mix(color, stripe, 0.7), is_beyond && is_stripe);
}
#endif

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> @location(0) vec4<f32> {
    let to_eye = normalize(view.world_position - in.world_position.xyz);
    var normal = normalize(in.world_normal);
    if (!is_front) {
        normal = -normal;
    }
    // Smoothed normals can point away from the eye at an outline; there they are bent back.
    let away = GRAZING - dot(normal, to_eye);
    normal = normalize(normal + to_eye * max(away, 0.0));
    let key = key_direction();
    let facing = saturate(dot(normal, to_eye));
    let soft = finish.translucency;

    let shadow = key_visibility(in.world_position, normal);
#ifdef VERTEX_UVS_B
    // Plain and matt, so that equal values look alike: shading only tells the shape.
    let lit = 0.68 + 0.22 * saturate(dot(normal, key)) * shadow + 0.10 * normal.y;
    let rim_light = 0.15 * finish.highlight * (1.0 - facing);
    return vec4<f32>(value_color(in.uv_b, in.position.xy) * lit + rim_light, 1.0);
#else
    let wrap = 0.6 * soft;
    let cosine = dot(normal, key);
    let wrapped = saturate((cosine + wrap) / ((1.0 + wrap) * (1.0 + wrap)));
    // Inside a jelly a shadow's edge is lit by its neighborhood, and takes its color.
    let shade = mix(shadow, 1.0, 0.3 * soft);
    let deep = finish.deep;
    let terminator = mix(deep, finish.color, smoothstep(-0.2, 0.7, cosine));

    // Light gets scarce where a surface looks down upon a near floor.
    let height = max(in.world_position.y - finish.floor, 0.0);
    let open = 1.0 - 0.62 * saturate(0.35 - 0.65 * normal.y) * exp(-3.2 * height);

    var color = terminator * KEY * wrapped * shade;
    color += finish.color * ambient(normal) * open;

    // Light through the body: what leaves on the far side, what shines towards the eye, and
    // what makes thin outlines glow.
    let far_side = 0.20 * saturate(0.5 - 0.5 * cosine);
    let towards_eye = saturate(dot(to_eye, -normalize(key + 0.35 * normal)));
    let through = 0.6 * towards_eye * towards_eye * towards_eye * shade;
    let outline = 0.16 * (1.0 - facing);
    color += deep * KEY * soft * (far_side + through + outline + 0.08);

    let aslant = 1.0 - facing;
    let aslant_squared = aslant * aslant;
    let fresnel = 0.04
        + 0.96 * aslant_squared * aslant_squared * aslant * (1.0 - 0.6 * finish.roughness);
    let mirrored = reflect(-to_eye, normal);
    let glint = reflection(mirrored, finish.roughness) * mix(0.45, 1.0, shadow) * mix(0.5, 1.0, open);
    color = mix(color, glint, fresnel * finish.gloss);

    let rim = aslant_squared * sqrt(aslant);
    color += finish.highlight * (0.06 * finish.color + rim * (0.35 * finish.color + 0.35));
    // Glass: more of it is in the way at grazing angles, and its reflection is opaque.
    let opacity = mix(finish.opacity, 1.0, 0.6 * rim);
    return vec4<f32>(expose(color, in.position.xy).rgb, opacity);
#endif
}
