// ln f = MLP(T(H, warp(wh)) z, T(D, warp(wd)) z) with z = T(S, uv, J): the counterpart of jaxbrdf/models/spatial_gated.py. What
// a material does not have is not compiled: JB_PROBES is the most lookups under a footprint, and without it places are points;
// JB_DECODED is the place of the linear map from z to a frame's numbers, from JB_FRAME on, and those of warps, from JB_WARPS on;
// JB_GATING is the number of rows of the matrices, and without it z is an input of the network.
#include "angular.cl"
#include "frame.cl"
#include "gating.cl"
#include "image.cl"
#include "network.cl"
#include "output.cl"
#include "polar.cl"

JB_INLINE jb_real3 JB_NAME(model)(
    const jb_real3 wi, const jb_real3 wo, const jb_real u, const jb_real v, const jb_Footprint footprint,
    JB_WEIGHTS const float *parameters, __global const jb_stored *texels) {
    const jb_Layout layout = {JB_S_HEIGHT, JB_S_WIDTH, JB_S_WRAP, JB_S_TOP, JB_S_CHANNELS};
    float8 z[JB_S_BLOCKS * JB_WIDTH];
    jb_real latent[JB_S_BLOCKS * JB_BLOCK];
#ifdef JB_PROBES
    const jb_Probes probes = jb_probes(layout, footprint, JB_PROBES);
#else
    const jb_Level finest = jb_level(layout, (jb_integer)(0));
#endif
    _Pragma("unroll") for (int n = 0; n < JB_S_BLOCKS; ++n) {
        __global const jb_stored *own = texels + JB_S + n * JB_BLOCK;
        float8 *rows = z + n * JB_WIDTH;
        jb_clear(rows);
#ifdef JB_PROBES
        jb_add_under(own, layout, u, v, probes, JB_PROBES, rows);
#else
        jb_add_texels(own, layout, finest, u, v, JB_REAL(1.0f), rows);
#endif
        JB_SPREAD(rows, (latent + n * JB_BLOCK), JB_BLOCK)
    }
#ifdef JB_DECODED
    jb_real numbers[JB_DECODED_WIDEST];
    {
        jb_real *x = latent, *y = numbers;
        JB_WEIGHTS const float *weights = parameters + JB_DECODED;
        JB_DECODED_LAYERS(JB_LAYER)
    }
#endif
#ifdef JB_FRAME
    const jb_Frame frame = jb_frame(numbers + JB_FRAME);
    const jb_HalfDifference at = jb_seen_half_difference(frame, wi, wo);
#else
    const jb_HalfDifference at = jb_half_difference(wi, wo);
#endif
#ifdef JB_WARPS
    const jb_real r_h = jb_decoded_warp(numbers + JB_WARPS, JB_WARP_TERMS, jb_log2_disk_radius(at.wh));
    const jb_real r_d = jb_decoded_warp(numbers + JB_WARPS + 2 * JB_WARP_TERMS, JB_WARP_TERMS, jb_log2_disk_radius(at.wd));
#else
    const jb_real r_h = jb_disk_radius(at.wh), r_d = jb_disk_radius(at.wd);
#endif
    const jb_real turn_h = jb_full_turn(at.wh), turn_d = jb_half_turn(at.wd);
    jb_real first[JB_MLP_WIDEST], second[JB_MLP_WIDEST];
    jb_real *x = first, *y = second;
#ifdef JB_GATING
    float8 products[JB_GATING * JB_WIDTH];
    jb_gated_fetch(
        texels + JB_H, JB_H_RADII, JB_H_AZIMUTHS, JB_GATING, JB_S_BLOCKS, r_h, turn_h, z, products, x);
    jb_gated_fetch(
        texels + JB_D, JB_D_RADII, JB_D_AZIMUTHS, JB_GATING, JB_S_BLOCKS, r_d, turn_d, z, products, x + JB_GATING);
#else
    jb_angular_fetch(texels + JB_H, JB_H_RADII, JB_H_AZIMUTHS, JB_H_CHANNELS, r_h, turn_h, x);
    jb_angular_fetch(texels + JB_D, JB_D_RADII, JB_D_AZIMUTHS, JB_D_CHANNELS, r_d, turn_d, x + JB_H_CHANNELS);
    _Pragma("unroll") for (int c = 0; c < JB_S_CHANNELS; ++c) { x[2 * JB_H_CHANNELS + c] = latent[c]; }
#endif
    JB_WEIGHTS const float *weights = parameters + JB_MLP;
    JB_MLP_LAYERS(JB_LAYER)
    const jb_real3 f = {jb_reflectance(x[0]), jb_reflectance(x[1]), jb_reflectance(x[2])};
    return jb_above_horizon(wi, wo, f);
}
