// ln f = MLP(T(H, warp(wh)), T(D, warp(wd))) + k ln(mean secant): the counterpart of jaxbrdf/models/gated.py. The last
// term is there if HORIZON is.
#include "angular.cl"
#include "horizon.cl"
#include "mlp.cl"
#include "output.cl"
#include "polar.cl"

float3 model(
    const float3 wi, const float3 wo, __global const float *h, __global const float *d, WEIGHTS float *warp_h,
    WEIGHTS float *warp_d, WEIGHTS float *mlp HORIZON_PARAMETER) {
    const HalfDifference at = half_difference(wi, wo);
    const float r_h = radial_warp(warp_h, WARP_H_TERMS, disk_radius(at.wh));
    const float r_d = radial_warp(warp_d, WARP_D_TERMS, disk_radius(at.wd));
    float x[MLP_WIDEST];
#ifdef ISOTROPIC
    radial_fetch(h, H_RADII, H_CHANNELS, r_h, x);
#else
    angular_fetch(h, H_RADII, H_AZIMUTHS, H_CHANNELS, r_h, disk_turn(at.wh, 2.0f * M_PI_F), x);
#endif
    angular_fetch(d, D_RADII, D_AZIMUTHS, D_CHANNELS, r_d, disk_turn(at.wd, M_PI_F), x + H_CHANNELS);
    mlp_apply(mlp, x);
#ifdef HORIZON
    const float growth = *horizon * log_mean_secant(wi, wo);
    x[0] += growth;
    x[1] += growth;
    x[2] += growth;
#endif
    return reflectance(x);
}

// f of `count` pairs, each array `(count, 3)`.
__kernel void evaluate(
    const ulong count, __global const float *wi, __global const float *wo, __global float *f, __global const float *h,
    __global const float *d, WEIGHTS float *warp_h, WEIGHTS float *warp_d, WEIGHTS float *mlp HORIZON_PARAMETER) {
    const size_t i = get_global_id(0);
    if (i >= count) {
        return;
    }
    const float3 light = vload3(i, wi);
    const float3 view = vload3(i, wo);
    const bool lit = above_horizon(light, view);
    vstore3(lit ? model(light, view, h, d, warp_h, warp_d, mlp HORIZON_ARGUMENT) : (float3)(0.0f), i, f);
}
