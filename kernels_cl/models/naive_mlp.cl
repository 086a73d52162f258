// ln f = MLP(wi, wo): the counterpart of jaxbrdf/models/naive_mlp.py. JB_ISOTROPIC turns both until wo has no y,
// and the network has no weights for it.
#include "directions.cl"
#include "network.cl"
#include "output.cl"

JB_INLINE jb_real3 JB_NAME(model)(const jb_real3 wi, const jb_real3 wo, JB_WEIGHTS const float *weights) {
#ifdef JB_ISOTROPIC
    const jb_Azimuth phi = jb_azimuth_of(wo);
    const jb_real3 light = jb_turn_back(phi, wi);
    const jb_real3 view = jb_turn_back(phi, wo);
#else
    const jb_real3 light = wi;
    const jb_real3 view = wo;
#endif
    jb_real first[JB_MLP_WIDEST], second[JB_MLP_WIDEST];
    jb_real *x = first, *y = second;
    int n = 0;
    x[n++] = light.x;
    x[n++] = light.y;
    x[n++] = light.z;
    x[n++] = view.x;
#ifndef JB_ISOTROPIC
    x[n++] = view.y;
#endif
    x[n++] = view.z;
    weights += JB_MLP;
    JB_MLP_LAYERS(JB_LAYER)
    const jb_real3 f = {jb_reflectance(x[0]), jb_reflectance(x[1]), jb_reflectance(x[2])};
    return jb_above_horizon(wi, wo, f);
}
