// ln f = MLP(wh, wd): the counterpart of jaxbrdf/models/nbrdf.py.
#include "directions.cl"
#include "mlp.cl"
#include "output.cl"

float3 model(const float3 wi, const float3 wo, WEIGHTS float *mlp) {
    const HalfDifference at = half_difference(wi, wo);
#ifdef ISOTROPIC
    const float3 wh = (float3)(sin_theta(at.wh), 0.0f, at.wh.z);
#else
    const float3 wh = at.wh;
#endif
    float x[MLP_WIDEST] = {wh.x, wh.y, wh.z, at.wd.x, at.wd.y, at.wd.z};
    mlp_apply(mlp, x);
    return reflectance(x);
}

// f of `count` pairs, each array `(count, 3)`.
__kernel void evaluate(
    const ulong count, __global const float *wi, __global const float *wo, __global float *f, WEIGHTS float *mlp) {
    const size_t i = get_global_id(0);
    if (i >= count) {
        return;
    }
    const float3 light = vload3(i, wi);
    const float3 view = vload3(i, wo);
    vstore3(above_horizon(light, view) ? model(light, view, mlp) : (float3)(0.0f), i, f);
}
