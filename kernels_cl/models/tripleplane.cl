// ln f = MLP(T(H, wh), T(D, wd)): the counterpart of jaxbrdf/models/tripleplane.py.
#include "angular.cl"
#include "mlp.cl"
#include "output.cl"
#include "polar.cl"

float3 model(
    const float3 wi, const float3 wo, __global const float *h, __global const float *d, WEIGHTS float *mlp) {
    const HalfDifference at = half_difference(wi, wo);
    float x[MLP_WIDEST];
#ifdef ISOTROPIC
    radial_fetch(h, H_RADII, H_CHANNELS, disk_radius(at.wh), x);
#else
    angular_fetch(h, H_RADII, H_AZIMUTHS, H_CHANNELS, disk_radius(at.wh), disk_turn(at.wh, 2.0f * M_PI_F), x);
#endif
    angular_fetch(d, D_RADII, D_AZIMUTHS, D_CHANNELS, disk_radius(at.wd), disk_turn(at.wd, M_PI_F), x + H_CHANNELS);
    mlp_apply(mlp, x);
    return reflectance(x);
}

// f of `count` pairs, each array `(count, 3)`.
__kernel void evaluate(
    const ulong count, __global const float *wi, __global const float *wo, __global float *f, __global const float *h,
    __global const float *d, WEIGHTS float *mlp) {
    const size_t i = get_global_id(0);
    if (i >= count) {
        return;
    }
    const float3 light = vload3(i, wi);
    const float3 view = vload3(i, wo);
    vstore3(above_horizon(light, view) ? model(light, view, h, d, mlp) : (float3)(0.0f), i, f);
}
