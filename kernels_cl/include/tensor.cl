// GGX lobes of a roughness matrix: the counterpart of `Tensor` in jaxbrdf/core/roughness.py and of `_tensor` in
// jaxbrdf/models/ggx_mip.py.
#ifndef JB_TENSOR_CL
#define JB_TENSOR_CL

#include "microfacet.cl"

// LEAST_FILTERED in roughness.py, the square of 0.045, and what is left to one.
#define JB_LEAST_FILTERED 0.002025f
#define JB_FILTERED_RANGE 0.997975f

// The matrix [[a, c], [c, b]] and its determinant.
typedef struct {
    jb_real a;
    jb_real b;
    jb_real c;
    jb_real determinant;
} jb_Tensor;

// The matrix of raw numbers: a and b by a sigmoid between JB_LEAST_FILTERED and one, c a share tanh(raw_c) of the largest that
// leaves both eigenvalues there, whose square is the lesser of (1 - a) (1 - b) and (a - least) (b - least). The determinant
// is a b less that largest square, which either bound gives without a difference of products, and what the share leaves.
JB_INLINE jb_Tensor jb_raw_tensor(const jb_real raw_a, const jb_real raw_b, const jb_real raw_c) {
    const jb_real above_a = JB_FILTERED_RANGE * jb_sigmoid(raw_a), above_b = JB_FILTERED_RANGE * jb_sigmoid(raw_b);
    const jb_real below_a = JB_FILTERED_RANGE * jb_sigmoid(-raw_a), below_b = JB_FILTERED_RANGE * jb_sigmoid(-raw_b);
    const jb_real upper = below_a * below_b, lower = above_a * above_b;
    const jb_integer is_lower = lower < upper;
    const jb_real largest = is_lower ? lower : upper, share = jb_tanh(raw_c);
    jb_Tensor out;
    out.a = JB_LEAST_FILTERED + above_a;
    out.b = JB_LEAST_FILTERED + above_b;
    out.c = share * jb_safe_sqrt(largest);
    const jb_real least = is_lower ? JB_LEAST_FILTERED * (out.a + above_b) : out.a - below_b;
    out.determinant = least + (1.0f - share * share) * largest;
    return out;
}

// |A w|, as the facets' standard surface sees w.
JB_INLINE jb_real jb_stretched_by(const jb_Tensor own, const jb_real3 w) {
    const jb_real x = own.a * w.x + own.c * w.y, y = own.c * w.x + own.b * w.y;
    return jb_safe_sqrt(x * x + y * y + w.z * w.z);
}

// D G2 / (4 cos_i cos_o) with masking correlated by height, as `jb_ggx_lobe` has it along axes; of lifted directions.
JB_INLINE jb_real jb_tensor_lobe(const jb_Tensor own, const jb_real3 wi, const jb_real3 wo, const jb_real3 wh) {
    const jb_real inverse = 1.0f / own.determinant;
    const jb_real x = (own.b * wh.x - own.c * wh.y) * inverse, y = (own.a * wh.y - own.c * wh.x) * inverse;
    const jb_real spread = x * x + y * y + wh.z * wh.z;
    const jb_real across = jb_stretched_by(own, wi) * wo.z + jb_stretched_by(own, wo) * wi.z;
    return 0.159154943f * inverse / (spread * spread * across);
}

#endif
