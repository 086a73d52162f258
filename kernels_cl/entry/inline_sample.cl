// The sampler of one material that another kernel calls for one hit point.
#include "proxy.cl"

// A direction to the light for a viewer, of u in [0, 1)^3; its density [1/sr], zero below the horizon, goes to `pdf`.
float3 JB_NAME(sample)(const float3 wo, const float3 u, float *pdf, __global const float *nodes) {
    const jb_real3 view = {wo.x, wo.y, wo.z};
    const jb_real3 chance = {u.x, u.y, u.z};
    jb_real density;
    const jb_real3 wi = jb_proxy_sample(nodes, JB_PROXY_AZIMUTHS, JB_PROXY_ELEVATIONS, view, chance, &density);
    *pdf = density;
    return (float3)(wi.x, wi.y, wi.z);
}

// Density [1/sr] with which `sample` draws wi for the viewer wo.
float JB_NAME(pdf)(const float3 wi, const float3 wo, __global const float *nodes) {
    const jb_real3 light = {wi.x, wi.y, wi.z};
    const jb_real3 view = {wo.x, wo.y, wo.z};
    return jb_proxy_pdf(nodes, JB_PROXY_AZIMUTHS, JB_PROXY_ELEVATIONS, light, view);
}
