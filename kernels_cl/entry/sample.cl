// The kernels of one material's sampler: `count` directions to the light and their densities, of viewers and of u in
// [0, 1)^3; and densities of given pairs. Arrays are planar or interleaved (queries.cl); `nodes` is the sampler's table.
#include "queries.cl"
#include "proxy.cl"

__kernel __attribute__((reqd_work_group_size(JB_GROUP, 1, 1))) void JB_NAME(sample)(
    const ulong count, const uint is_interleaved, __global const float *wo, __global const float *u, __global float *wi,
    __global float *pdf, __global const float *nodes) {
    const size_t first = get_global_id(0) * JB_WIDTH;
    if (first < count) {
        const jb_real3 view = jb_load_directions(wo, first, count, is_interleaved);
        const jb_real3 chance = jb_load_directions(u, first, count, is_interleaved);
        jb_real density;
        const jb_real3 light = jb_proxy_sample(nodes, JB_PROXY_AZIMUTHS, JB_PROXY_ELEVATIONS, view, chance, &density);
        jb_store_colours(wi, first, count, is_interleaved, light);
        jb_store(pdf, first, count, density);
    }
}

__kernel __attribute__((reqd_work_group_size(JB_GROUP, 1, 1))) void JB_NAME(pdf)(
    const ulong count, const uint is_interleaved, __global const float *wi, __global const float *wo,
    __global float *pdf, __global const float *nodes) {
    const size_t first = get_global_id(0) * JB_WIDTH;
    if (first < count) {
        const jb_real3 light = jb_load_directions(wi, first, count, is_interleaved);
        const jb_real3 view = jb_load_directions(wo, first, count, is_interleaved);
        jb_store(pdf, first, count, jb_proxy_pdf(nodes, JB_PROXY_AZIMUTHS, JB_PROXY_ELEVATIONS, light, view));
    }
}
