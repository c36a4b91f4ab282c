// Decodes sRGB without powers, which take a software renderer long.

#define_import_path pliant::srgb

// Linear RGB of sRGB, within 0.44 steps of 8 bits: a polynomial through 0 and 1, fitted by least
// squares to the steps.
fn linear(color: vec3<f32>) -> vec3<f32> {
    var factor = vec3<f32>(0.667941540);
    factor = factor * color - 1.640305712;
    factor = factor * color + 1.700282621;
    factor = factor * color + 0.206028707;
    factor = factor * color + 0.066052845;
    return factor * color;
}
