// The function of one material that varies over a surface, which another kernel calls for one hit point.
#include "scale.cl"

// f(wi, wo) [1/sr], linear Rec.709, no cosine, zero below the horizon, of unit vectors in the local frame, at texture
// coordinates uv under a footprint, row by row: the derivatives of u, then those of v. A footprint of zero is a point.
float3 JB_NAME(eval)(
    const float3 wi, const float3 wo, const float2 uv, const float4 footprint, __global const float *parameters) {
    const jb_real3 light = {wi.x, wi.y, wi.z};
    const jb_real3 view = {wo.x, wo.y, wo.z};
    const jb_Footprint own = {footprint.x, footprint.y, footprint.z, footprint.w};
    __global const jb_stored *texels = (__global const jb_stored *)(parameters + JB_TEXELS);
    jb_real3 f = JB_NAME(model)(light, view, uv.x, uv.y, own, parameters, texels);
#ifdef JB_SCALE
    f = jb_scaled(parameters + JB_SCALE, light, view, f);
#endif
    return (float3)(f.x, f.y, f.z);
}
