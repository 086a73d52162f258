// ln f = MLP(z, wi_xy, wo_xy) with z = T(S, uv + h (wo_x, -wo_y) / max(wo_z, 1/16), J) and h = MLP_o(T(S_o, uv), wo_xy): the
// counterpart of jaxbrdf/models/neumip.py. JB_OFFSET is the texture S_o and JB_HEIGHT its network; JB_PROBES is the most
// lookups under a footprint, and without it places are points.
#include "image.cl"
#include "network.cl"
#include "output.cl"

JB_INLINE jb_real3 JB_NAME(model)(
    const jb_real3 wi, const jb_real3 wo, const jb_real u, const jb_real v, const jb_Footprint footprint,
    JB_WEIGHTS const float *parameters, __global const jb_stored *texels) {
    const jb_Layout layout = {JB_S_HEIGHT, JB_S_WIDTH, JB_S_WRAP, JB_S_TOP, JB_S_CHANNELS};
    const jb_Layout relief = {JB_OFFSET_HEIGHT, JB_OFFSET_WIDTH, JB_OFFSET_WRAP, JB_OFFSET_TOP, JB_OFFSET_CHANNELS};
    // of height one, no longer than LEAST_COSINE in neumip.py lets it be
    jb_real offset = 1.0f / jb_at_least(wo.z, 0.0625f);
    {
        jb_real first[JB_HEIGHT_WIDEST], second[JB_HEIGHT_WIDEST];
        jb_real *x = first, *y = second;
        jb_bilinear(texels + JB_OFFSET, relief, u, v, 0, x);
        x[JB_OFFSET_CHANNELS] = wo.x;
        x[JB_OFFSET_CHANNELS + 1] = wo.y;
        JB_WEIGHTS const float *weights = parameters + JB_HEIGHT;
        JB_HEIGHT_LAYERS(JB_LAYER)
        offset *= x[0];
    }
    const jb_real at_u = u + offset * wo.x, at_v = v - offset * wo.y;
    jb_real first[JB_MLP_WIDEST], second[JB_MLP_WIDEST];
    jb_real *x = first, *y = second;
#ifdef JB_PROBES
    jb_anisotropic(texels + JB_S, layout, at_u, at_v, footprint, JB_PROBES, x);
#else
    jb_bilinear(texels + JB_S, layout, at_u, at_v, 0, x);
#endif
    x[JB_S_CHANNELS] = wi.x;
    x[JB_S_CHANNELS + 1] = wi.y;
    x[JB_S_CHANNELS + 2] = wo.x;
    x[JB_S_CHANNELS + 3] = wo.y;
    JB_WEIGHTS const float *weights = parameters + JB_MLP;
    JB_MLP_LAYERS(JB_LAYER)
    const jb_real3 f = {jb_reflectance(x[0]), jb_reflectance(x[1]), jb_reflectance(x[2])};
    return jb_above_horizon(wi, wo, f);
}
