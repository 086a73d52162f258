// A Lambert body and a GGX lobe about a normal, of twelve numbers T(S, uv, J): the counterpart of jaxbrdf/models/ggx_mip.py.
// JB_PROBES is the most lookups under a footprint, and without it places are points.
#include "fresnel.cl"
#include "image.cl"
#include "microfacet.cl"
#include "normal_mapped.cl"
#include "output.cl"
#include "tensor.cl"

// LEAST_VALUE in ggx_mip.py.
#define JB_LEAST_VALUE 1e-12f

JB_INLINE jb_real3 JB_NAME(model)(
    const jb_real3 wi, const jb_real3 wo, const jb_real u, const jb_real v, const jb_Footprint footprint,
    JB_WEIGHTS const float *parameters, __global const jb_stored *texels) {
    const jb_Layout layout = {JB_S_HEIGHT, JB_S_WIDTH, JB_S_WRAP, JB_S_TOP, JB_S_CHANNELS};
    jb_real numbers[JB_S_CHANNELS];
#ifdef JB_PROBES
    jb_anisotropic(texels + JB_S, layout, u, v, footprint, JB_PROBES, numbers);
#else
    jb_bilinear(texels + JB_S, layout, u, v, 0, numbers);
#endif
    // z of a raw zero is one; roughness and colour begin at FIRST_ROUGHNESS and FIRST_SPECULAR in ggx_mip.py
    const jb_real3 upward = {numbers[6], numbers[7], jb_softplus(0.541324855f + numbers[8])};
    const jb_NormalMapped seen = jb_normal_mapped(upward, wi, wo);
    const jb_Tensor roughness = jb_raw_tensor(numbers[9] - 1.1f, numbers[10] - 1.1f, numbers[11]);
    const jb_real3 light = jb_lift(seen.wi), view = jb_lift(seen.wo);
    const jb_Facet facet = jb_facet(light, view);
    const jb_real lobe = jb_tensor_lobe(roughness, light, view, facet.wh);
    const jb_real grazing = jb_schlick_weight(facet.cos);
    jb_real f[3];
    _Pragma("unroll") for (int c = 0; c < 3; ++c) {
        const jb_real specular = jb_sigmoid(numbers[c] - 3.2f), diffuse = jb_sigmoid(numbers[3 + c]);
        const jb_real base = 0.318309886f * diffuse + lobe * (specular + (1.0f - specular) * grazing);
        f[c] = base * seen.gain + JB_LEAST_VALUE;
    }
    const jb_real3 out = {f[0], f[1], f[2]};
    return jb_above_horizon(wi, wo, out);
}
#undef JB_LEAST_VALUE
