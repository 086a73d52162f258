// ln f = MLP(T(H, warp(wh)), T(D, warp(wd))) + k ln(mean secant): the counterpart of jaxbrdf/models/gated.py. What a
// material does not have is not compiled: JB_ISOTROPIC has no azimuth of wh, JB_WARP_H and JB_WARP_D are the places of the
// warps, JB_HORIZON that of the growth's exponent.
#include "angular.cl"
#include "horizon.cl"
#include "network.cl"
#include "output.cl"
#include "polar.cl"

JB_INLINE jb_real3 JB_NAME(model)(
    const jb_real3 wi, const jb_real3 wo, JB_WEIGHTS const float *weights, __global const jb_stored *texels) {
    const jb_HalfDifference at = jb_half_difference(wi, wo);
#ifdef JB_WARP_H
    const jb_real r_h = jb_radial_warp(weights + JB_WARP_H, JB_WARP_H_TERMS, jb_log2_disk_radius(at.wh));
#else
    const jb_real r_h = jb_disk_radius(at.wh);
#endif
#ifdef JB_WARP_D
    const jb_real r_d = jb_radial_warp(weights + JB_WARP_D, JB_WARP_D_TERMS, jb_log2_disk_radius(at.wd));
#else
    const jb_real r_d = jb_disk_radius(at.wd);
#endif
#ifdef JB_HORIZON
    const jb_real growth = weights[JB_HORIZON] * jb_log2_mean_secant(wi, wo);
#endif
    jb_real first[JB_MLP_WIDEST], second[JB_MLP_WIDEST];
    jb_real *x = first, *y = second;
#ifdef JB_ISOTROPIC
    jb_radial_fetch(texels + JB_H, JB_H_RADII, JB_H_CHANNELS, r_h, x);
#else
    jb_angular_fetch(texels + JB_H, JB_H_RADII, JB_H_AZIMUTHS, JB_H_CHANNELS, r_h, jb_full_turn(at.wh), x);
#endif
    jb_angular_fetch(
        texels + JB_D, JB_D_RADII, JB_D_AZIMUTHS, JB_D_CHANNELS, r_d, jb_half_turn(at.wd), x + JB_H_CHANNELS);
    weights += JB_MLP;
    JB_MLP_LAYERS(JB_LAYER)
#ifdef JB_HORIZON
    const jb_real3 f = {jb_reflectance(x[0] + growth), jb_reflectance(x[1] + growth), jb_reflectance(x[2] + growth)};
#else
    const jb_real3 f = {jb_reflectance(x[0]), jb_reflectance(x[1]), jb_reflectance(x[2])};
#endif
    return jb_above_horizon(wi, wo, f);
}
