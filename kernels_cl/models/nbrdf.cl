// ln f = MLP(wh, wd): the counterpart of jaxbrdf/models/nbrdf.py. With JB_ISOTROPIC wh has no y,
// and the network no weights for it.
#include "directions.cl"
#include "network.cl"
#include "output.cl"

JB_INLINE jb_real3 JB_NAME(model)(const jb_real3 wi, const jb_real3 wo, JB_WEIGHTS const float *weights) {
    const jb_HalfDifference at = jb_half_difference(wi, wo);
    jb_real first[JB_MLP_WIDEST], second[JB_MLP_WIDEST];
    jb_real *x = first, *y = second;
    int n = 0;
#ifdef JB_ISOTROPIC
    x[n++] = jb_sin_theta(at.wh);
#else
    x[n++] = at.wh.x;
    x[n++] = at.wh.y;
#endif
    x[n++] = at.wh.z;
    x[n++] = at.wd.x;
    x[n++] = at.wd.y;
    x[n++] = at.wd.z;
    weights += JB_MLP;
    JB_MLP_LAYERS(JB_LAYER)
    const jb_real3 f = {jb_reflectance(x[0]), jb_reflectance(x[1]), jb_reflectance(x[2])};
    return jb_above_horizon(wi, wo, f);
}
