// ln f = MLP(wi, wo): the counterpart of jaxbrdf/models/naive_mlp.py.
#include "directions.cl"
#include "mlp.cl"
#include "output.cl"

float3 model(float3 wi, float3 wo, WEIGHTS float *mlp) {
#ifdef ISOTROPIC
    const Azimuth phi = azimuth_of(wo);
    wi = turn_back(phi, wi);
    wo = turn_back(phi, wo);
#endif
    float x[MLP_WIDEST] = {wi.x, wi.y, wi.z, wo.x, wo.y, wo.z};
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
