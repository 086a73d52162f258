// ln f = MLP(T_1 wi, T_1 wo, ..., T_N wi, T_N wo, z) with z = T(S, uv, J): the counterpart of jaxbrdf/models/zeltner.py. JB_FRAME is
// the place of the linear map from z to the numbers of JB_FRAME_COUNT frames; JB_PROBES is the most lookups under a footprint,
// and without it places are points.
#include "frame.cl"
#include "image.cl"
#include "network.cl"
#include "output.cl"

JB_INLINE jb_real3 JB_NAME(model)(
    const jb_real3 wi, const jb_real3 wo, const jb_real u, const jb_real v, const jb_Footprint footprint,
    JB_WEIGHTS const float *parameters, __global const jb_stored *texels) {
    const jb_Layout layout = {JB_S_HEIGHT, JB_S_WIDTH, JB_S_WRAP, JB_S_TOP, JB_S_CHANNELS};
    jb_real latent[JB_S_CHANNELS];
#ifdef JB_PROBES
    jb_anisotropic(texels + JB_S, layout, u, v, footprint, JB_PROBES, latent);
#else
    jb_bilinear(texels + JB_S, layout, u, v, 0, latent);
#endif
    jb_real numbers[JB_FRAME_WIDEST];
    {
        jb_real *x = latent, *y = numbers;
        JB_WEIGHTS const float *weights = parameters + JB_FRAME;
        JB_FRAME_LAYERS(JB_LAYER)
    }
    jb_real first[JB_MLP_WIDEST], second[JB_MLP_WIDEST];
    jb_real *x = first, *y = second;
    _Pragma("unroll") for (int n = 0; n < JB_FRAME_COUNT; ++n) {
        const jb_Frame frame = jb_frame(numbers + JB_FRAME_NUMBERS * n);
        const jb_real3 light = jb_seen(frame, wi), view = jb_seen(frame, wo);
        jb_real *own = x + 6 * n;
        own[0] = light.x;
        own[1] = light.y;
        own[2] = light.z;
        own[3] = view.x;
        own[4] = view.y;
        own[5] = view.z;
    }
    _Pragma("unroll") for (int c = 0; c < JB_S_CHANNELS; ++c) { x[6 * JB_FRAME_COUNT + c] = latent[c]; }
    JB_WEIGHTS const float *weights = parameters + JB_MLP;
    JB_MLP_LAYERS(JB_LAYER)
    const jb_real3 f = {jb_reflectance(x[0]), jb_reflectance(x[1]), jb_reflectance(x[2])};
    return jb_above_horizon(wi, wo, f);
}
