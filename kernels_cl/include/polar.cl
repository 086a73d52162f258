// Directions as places on the unit disk, and their learned radial warp: the counterparts of `polar` in
// jaxbrdf/texture/angular.py and of jaxbrdf/models/warp.py.
#ifndef JB_POLAR_CL
#define JB_POLAR_CL

#include "directions.cl"

// Length of w's projection on the surface, in [0, 1].
JB_INLINE jb_real jb_disk_radius(const jb_real3 w) { return jb_min(jb_sin_theta(w), JB_REAL(1.0f)); }

// Its logarithm to the base 2, from the square: no root. No less than -62, of which any exponent from 1/2 on makes nothing.
JB_INLINE jb_real jb_log2_disk_radius(const jb_real3 w) {
    const jb_real squared = w.x * w.x + w.y * w.y;
    return 0.5f * jb_log2(jb_min(jb_max(squared, JB_REAL(JB_TINY)), JB_REAL(1.0f)));
}

// Azimuth of w over the full circle, in [0, 1].
JB_INLINE jb_real jb_full_turn(const jb_real3 w) {
    const jb_real turn = jb_upper_atan2(jb_abs(w.y), w.x) * 0.159154943f;
    return w.y < 0.0f ? 1.0f - turn : turn;
}

// Azimuth of w over half a circle, in [0, 1]: w and -w have the same.
JB_INLINE jb_real jb_half_turn(const jb_real3 w) {
    return jb_upper_atan2(jb_abs(w.y), w.y < 0.0f ? -w.x : w.x) * 0.318309886f;
}

// sum_k w_k r^alpha_k (Timonen et al., Eq. 7) of log2(r); `terms` holds the w, then the alpha.
JB_INLINE jb_real jb_radial_warp(JB_WEIGHTS const float *terms, const int count, const jb_real log_r) {
    jb_real warped = JB_REAL(0.0f);
    _Pragma("unroll") for (int k = 0; k < count; ++k) {
        warped += terms[k] * jb_bounded_exp2(jb_at_least(terms[count + k] * log_r, -126.0f));
    }
    return warped;
}

// The same of a warp of each query's own, decoded from its latent: logits, then exponents above 1/2 before softplus. The host
// has scaled both to the base 2.
JB_INLINE jb_real jb_decoded_warp(const jb_real *numbers, const int count, const jb_real log_r) {
    jb_real largest = numbers[0];
    _Pragma("unroll") for (int k = 1; k < count; ++k) { largest = jb_max(numbers[k], largest); }
    jb_real warped = JB_REAL(0.0f), total = JB_REAL(0.0f);
    _Pragma("unroll") for (int k = 0; k < count; ++k) {
        const jb_real raw = numbers[count + k];
        const jb_real beyond = jb_log2(1.0f + jb_bounded_exp2(jb_at_least(-jb_abs(raw), -126.0f)));
        const jb_real exponent = 0.5f + 0.693147181f * (jb_max(raw, JB_REAL(0.0f)) + beyond);
        const jb_real share = jb_bounded_exp2(jb_at_least(numbers[k] - largest, -126.0f));
        total += share;
        warped += share * jb_bounded_exp2(jb_at_least(exponent * log_r, -126.0f));
    }
    return warped / total;
}

#endif
