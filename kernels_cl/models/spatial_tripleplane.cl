// ln f = MLP(T(H, wh), T(D, wd), z) with z = T(S, uv, J): the counterpart of jaxbrdf/models/spatial_tripleplane.py. JB_PROBES is
// the most lookups under a footprint, and without it places are points.
#include "angular.cl"
#include "image.cl"
#include "network.cl"
#include "output.cl"
#include "polar.cl"

JB_INLINE jb_real3 JB_NAME(model)(
    const jb_real3 wi, const jb_real3 wo, const jb_real u, const jb_real v, const jb_Footprint footprint,
    JB_WEIGHTS const float *parameters, __global const jb_stored *texels) {
    const jb_Layout layout = {JB_S_HEIGHT, JB_S_WIDTH, JB_S_WRAP, JB_S_TOP, JB_S_CHANNELS};
    const jb_HalfDifference at = jb_half_difference(wi, wo);
    const jb_real r_h = jb_disk_radius(at.wh), r_d = jb_disk_radius(at.wd);
    jb_real first[JB_MLP_WIDEST], second[JB_MLP_WIDEST];
    jb_real *x = first, *y = second;
    jb_angular_fetch(texels + JB_H, JB_H_RADII, JB_H_AZIMUTHS, JB_H_CHANNELS, r_h, jb_full_turn(at.wh), x);
    jb_angular_fetch(
        texels + JB_D, JB_D_RADII, JB_D_AZIMUTHS, JB_D_CHANNELS, r_d, jb_half_turn(at.wd), x + JB_H_CHANNELS);
#ifdef JB_PROBES
    jb_anisotropic(texels + JB_S, layout, u, v, footprint, JB_PROBES, x + 2 * JB_H_CHANNELS);
#else
    jb_bilinear(texels + JB_S, layout, u, v, 0, x + 2 * JB_H_CHANNELS);
#endif
    JB_WEIGHTS const float *weights = parameters + JB_MLP;
    JB_MLP_LAYERS(JB_LAYER)
    const jb_real3 f = {jb_reflectance(x[0]), jb_reflectance(x[1]), jb_reflectance(x[2])};
    return jb_above_horizon(wi, wo, f);
}
