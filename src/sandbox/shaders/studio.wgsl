// The light set of the studio, as functions that floor, bodies and backdrop share.
//
// A photographer's table: one large warm key light from the upper left (the only
// light that casts a shadow; its direction is the Bevy light's), two soft boxes that
// exist as reflections, a cool sky that fills, and a floor that bounces warm light
// back. Radiance is relative: a white surface under everything is near 1.

#define_import_path pliant::studio

#import bevy_pbr::mesh_view_bindings::{lights, view}
#import bevy_pbr::shadows::fetch_directional_shadow
#ifdef TONEMAP_IN_SHADER
#import bevy_core_pipeline::tonemapping::{screen_space_dither, tone_mapping}
#endif

const KEY: vec3<f32> = vec3<f32>(0.98, 0.90, 0.79);
const SKY: vec3<f32> = vec3<f32>(0.40, 0.45, 0.52);
const BOUNCE: vec3<f32> = vec3<f32>(0.30, 0.26, 0.22);
const HORIZON: vec3<f32> = vec3<f32>(0.430, 0.530, 0.545);
const ZENITH: vec3<f32> = vec3<f32>(0.190, 0.350, 0.410);

// Direction from a surface to the key light.
fn key_direction() -> vec3<f32> {
    return lights.directional_lights[0].direction_to_light;
}

// Share of the key light that reaches a point, 0 in shadow.
fn key_visibility(position: vec4<f32>, normal: vec3<f32>, frag_coord: vec2<f32>) -> f32 {
    let view_z = dot(vec4<f32>(
        view.view_from_world[0].z,
        view.view_from_world[1].z,
        view.view_from_world[2].z,
        view.view_from_world[3].z,
    ), position);
    return fetch_directional_shadow(0u, position, normal, view_z, frag_coord);
}

// What the backdrop shows in a direction: a cove that rises from the floor's colour.
fn backdrop(direction: vec3<f32>) -> vec3<f32> {
    let rise = smoothstep(-0.02, 0.50, direction.y);
    return mix(HORIZON, ZENITH, rise);
}

// Light that arrives from everywhere but the key, on a surface with this normal.
fn ambient(normal: vec3<f32>) -> vec3<f32> {
    return mix(BOUNCE, SKY, normal.y * 0.5 + 0.5);
}

// A rectangular light at infinity, seen in a mirror of some roughness.
fn soft_box(
    direction: vec3<f32>,
    centre: vec3<f32>,
    right: vec3<f32>,
    half_size: vec2<f32>,
    blur: f32,
) -> f32 {
    let forward = dot(direction, centre);
    let up = cross(centre, right);
    let at = abs(vec2<f32>(dot(direction, right), dot(direction, up))) / max(forward, 1e-3);
    let edge = 1.0 - smoothstep(half_size - blur, half_size + blur, at);
    // A blurred box keeps its light: what it gains in width it loses in height.
    let spread = (half_size.x * half_size.y)
        / ((half_size.x + 0.5 * blur) * (half_size.y + 0.5 * blur));
    return select(0.0, edge.x * edge.y * spread, forward > 0.0);
}

// What a mirror of this perceptual roughness reflects from a direction.
fn reflection(direction: vec3<f32>, roughness: f32) -> vec3<f32> {
    let blur = 0.02 + roughness;
    let floor_or_sky = smoothstep(-0.15 - roughness, 0.15 + roughness, direction.y);
    let room = mix(BOUNCE * 0.9, mix(HORIZON, ZENITH, smoothstep(0.0, 0.9, direction.y)), floor_or_sky);
    let key = key_direction();
    let right = normalize(cross(vec3<f32>(0.0, 1.0, 0.0), key));
    let main = soft_box(direction, key, right, vec2<f32>(0.34, 0.46), blur);
    let back = normalize(vec3<f32>(-key.x * 1.2, 0.55, -key.z));
    let strip = soft_box(
        direction,
        back,
        normalize(cross(vec3<f32>(0.0, 1.0, 0.0), back)),
        vec2<f32>(0.14, 0.85),
        blur,
    );
    return room + 7.0 * KEY * main + 2.6 * vec3<f32>(0.86, 0.95, 1.0) * strip;
}

// Linear light to what the screen wants.
fn expose(colour: vec3<f32>, frag_coord: vec2<f32>) -> vec4<f32> {
#ifdef TONEMAP_IN_SHADER
    let mapped = tone_mapping(vec4<f32>(colour, 1.0), view.color_grading).rgb;
    // Dithered in display space, where the eye counts steps; the target encodes again.
    let shown = pow(mapped, vec3<f32>(1.0 / 2.2)) + screen_space_dither(frag_coord);
    return vec4<f32>(pow(max(shown, vec3<f32>(0.0)), vec3<f32>(2.2)), 1.0);
#else
    return vec4<f32>(colour, 1.0);
#endif
}
