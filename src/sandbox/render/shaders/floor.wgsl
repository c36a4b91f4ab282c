// The studio floor: lit, in shadow where bodies stand, ruled every meter and every
// tenth of one, and fading into the backdrop so that it has no edge.

#import bevy_pbr::forward_io::VertexOutput
#import bevy_pbr::mesh_view_bindings::view
#import pliant::studio::{KEY, ambient, backdrop, expose, key_direction, key_visibility}

// Maximum fraction of the sky's light that bodies block, so that shade is never black.
const DEEPEST: f32 = 0.82;

struct Floor {
    // Center of the view on the floor [m] and the size of what is looked at [m].
    focus: vec3<f32>,
    scale: f32,
    grounding: Grounding,
}

// Bodies as balls: center and radius, and the color of the light that comes through them.
struct Grounding {
    balls: array<vec4<f32>, 24>,
    tints: array<vec4<f32>, 24>,
    count: u32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> stage: Floor;

const FLOOR: vec3<f32> = vec3<f32>(0.66, 0.63, 0.585);

// Coverage of a pixel by ruled lines: a line of `width` [cells], box-filtered over the
// pixel's footprint, so that fine lines fade to their mean instead of flickering.
fn ruling(at: vec2<f32>, footprint: vec2<f32>, width: f32) -> f32 {
    let drawn = clamp(vec2<f32>(width), footprint, vec2<f32>(0.5));
    let blur = footprint * 1.5;
    let distance = abs(fract(at - 0.5) - 0.5) * 2.0;
    var line = (1.0 - smoothstep(drawn - blur, drawn + blur, distance)) * saturate(width / drawn);
    line = mix(line, vec2<f32>(width), saturate(footprint * 2.0 - 1.0));
    return mix(line.x, 1.0, line.y);
}

// Fraction of the sky that the bodies cover, in w, and the key light that they let through, in xyz.
fn grounded(at: vec3<f32>, key: vec3<f32>) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    for (var i = 0u; i < stage.grounding.count; i++) {
        let ball = stage.grounding.balls[i];
        let to_ball = ball.xyz - at;
        let squared = dot(to_ball, to_ball);
        // Form factor of a ball: cosine times the squared sine of its half angle.
        let cosine = saturate(to_ball.y * inverseSqrt(squared));
        let covered = cosine * saturate(ball.w * ball.w / squared);
        let tint = stage.grounding.tints[i];
        // How deep the key light's ray passes through the ball, 0 at its rim and 1 at its center.
        let beside = to_ball - key * dot(to_ball, key);
        let deep = saturate(1.0 - dot(beside, beside) / (ball.w * ball.w));
        sum += vec4<f32>(tint.rgb * tint.w * deep, covered);
    }
    return sum;
}

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4<f32> {
    let up = vec3<f32>(0.0, 1.0, 0.0);
    let at = in.world_position.xz;
    let footprint = fwidth(at);
    let to_eye = view.world_position - in.world_position.xyz;
    let away = length(at - stage.focus.xz) / stage.scale;
    let fade = smoothstep(0.8, 14.0, away);

    let shadow = key_visibility(in.world_position, up);
    let key = key_direction();
    let ground = grounded(in.world_position.xyz, key);
    let open = 1.0 - DEEPEST * saturate(ground.w);
    let through = 0.75 * (1.0 - shadow) * ground.rgb;
    let light = KEY * key.y * (shadow + through) + ambient(up) * open;
    // The key light is a lamp over the table, not the sun.
    let pool = 1.0 - 0.20 * smoothstep(0.2, 3.0, away);

    let meters = ruling(at, footprint, 0.012);
    let tenths = ruling(at * 10.0, footprint * 10.0, 0.028);
    let ruled = max(0.42 * meters, 0.20 * tenths) * (1.0 - smoothstep(0.8, 6.0, away));
    let ink = mix(vec3<f32>(1.0), vec3<f32>(0.42, 0.50, 0.58), ruled);

    let lit = FLOOR * light * ink * pool;
    let beyond = backdrop(-normalize(to_eye));
    return expose(mix(lit, beyond, fade), in.position.xy);
}
