// The function of one material that another kernel calls for one hit point.
#include "scale.cl"

// f(wi, wo) [1/sr], linear Rec.709, no cosine, zero below the horizon, of unit vectors in the local frame.
float3 JB_NAME(eval)(const float3 wi, const float3 wo, __global const float *parameters) {
    const jb_real3 light = {wi.x, wi.y, wi.z};
    const jb_real3 view = {wo.x, wo.y, wo.z};
#ifdef JB_TEXELS
    const jb_real3 f = JB_NAME(model)(light, view, parameters, (__global const jb_stored *)(parameters + JB_TEXELS));
#else
    const jb_real3 f = JB_NAME(model)(light, view, parameters);
#endif
#ifdef JB_SCALE
    const jb_real3 scaled = jb_scaled(parameters + JB_SCALE, light, view, f);
    return (float3)(scaled.x, scaled.y, scaled.z);
#else
    return (float3)(f.x, f.y, f.z);
#endif
}
