// The light set of the studio, as functions that floor, bodies and backdrop share.
//
// A photographer's table: one large warm key light from the upper left (the only
// light that casts a shadow; its direction is the Bevy light's), two soft boxes that
// exist as reflections, a cool sky that fills, and a floor that bounces warm light
// back. Radiance is relative: a white surface under everything is near 1.

#define_import_path pliant::studio

#import bevy_pbr::mesh_view_bindings::lights
#import bevy_pbr::shadow_sampling::sample_shadow_map_castano_thirteen
#import bevy_pbr::shadows::world_to_directional_light_local
#ifdef TONEMAP_IN_SHADER
#import bevy_core_pipeline::tonemapping::{screen_space_dither, tonemapping_pbr_neutral}
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

// Fraction of the key light that reaches a point, 0 in shadow.
//
// The engine's own lookup also prepares blurred shadows and a second cascade behind branches; a
// software renderer runs both sides of every branch, and took more than twice as long for a frame.
fn key_visibility(position: vec4<f32>, normal: vec3<f32>) -> f32 {
#ifdef SHADOW_FILTER_METHOD_HARDWARE_2X2
    // Low quality: no shadows.
    return 1.0;
#else
    let light = &lights.directional_lights[0];
    let cascade = &(*light).cascades[0];
    // The bias along the normal keeps a curved surface from shading itself.
    let offset = (*light).shadow_normal_bias * (*cascade).texel_size * normal
        + (*light).shadow_depth_bias * (*light).direction_to_light;
    let at = world_to_directional_light_local(0u, 0u, vec4<f32>(position.xyz + offset, 1.0));
    let layer = i32((*light).depth_texture_base_index);
    let lit = sample_shadow_map_castano_thirteen(at.xy, at.z, layer);
    // Outside the map nothing is in shadow.
    return select(1.0, lit, at.w > 0.0);
#endif
}

// What the backdrop shows in a direction: a cove that rises from the floor's color.
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
    center: vec3<f32>,
    right: vec3<f32>,
    half_size: vec2<f32>,
    blur: f32,
) -> f32 {
    let forward = dot(direction, center);
    let up = cross(center, right);
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

// Linear light to what the screen wants: colors stay what they are, highlights roll off.
fn expose(color: vec3<f32>, frag_coord: vec2<f32>) -> vec4<f32> {
#ifdef TONEMAP_IN_SHADER
    let mapped = tonemapping_pbr_neutral(max(color, vec3<f32>(0.0)));
    // Noise of half a step of the screen, against bands in the gradients. The screen's steps lie
    // along a curve of about the power 2.2, and near its slope a square root will do.
    let slope = 2.2 * sqrt(mapped);
    return vec4<f32>(mapped + screen_space_dither(frag_coord) * slope, 1.0);
#else
    return vec4<f32>(color, 1.0);
#endif
}
