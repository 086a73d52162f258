// ln f = MLP(T(H, wh), T(D, wd)): the counterpart of jaxbrdf/models/tripleplane.py. JB_ISOTROPIC has no azimuth of wh.
#include "angular.cl"
#include "network.cl"
#include "output.cl"
#include "polar.cl"

JB_INLINE jb_real3 JB_NAME(model)(
    const jb_real3 wi, const jb_real3 wo, JB_WEIGHTS const float *weights, __global const jb_stored *texels) {
    const jb_HalfDifference at = jb_half_difference(wi, wo);
    const jb_real r_h = jb_disk_radius(at.wh);
    const jb_real r_d = jb_disk_radius(at.wd);
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
    const jb_real3 f = {jb_reflectance(x[0]), jb_reflectance(x[1]), jb_reflectance(x[2])};
    return jb_above_horizon(wi, wo, f);
}
