// The energy scale: the counterpart of jaxbrdf/brdf/energy_scale.py. `terms` holds the rows of its weights.
#ifndef JB_SCALE_CL
#define JB_SCALE_CL

#include "directions.cl"

#define JB_SCALE_KNOTS 12

// t = 1 - cos^(1/4).
JB_INLINE jb_real jb_grazing(const jb_real3 w) {
    return 1.0f - jb_safe_sqrt(jb_safe_sqrt(jb_lift(w).z));
}

// f c(wi) c(wo).
JB_INLINE jb_real3 jb_scaled(JB_WEIGHTS const float *terms, const jb_real3 wi, const jb_real3 wo, const jb_real3 f) {
    const jb_real t_i = jb_grazing(wi), t_o = jb_grazing(wo);
    jb_real red = 2.0f * terms[0] + (t_i + t_o) * terms[3];
    jb_real green = 2.0f * terms[1] + (t_i + t_o) * terms[4];
    jb_real blue = 2.0f * terms[2] + (t_i + t_o) * terms[5];
    _Pragma("unroll") for (int k = 0; k < JB_SCALE_KNOTS; ++k) {
        JB_WEIGHTS const float *term = terms + 6 + 3 * k;
        const jb_real i = jb_max(t_i - (float)k / JB_SCALE_KNOTS, JB_REAL(0.0f));
        const jb_real o = jb_max(t_o - (float)k / JB_SCALE_KNOTS, JB_REAL(0.0f));
        const jb_real squares = i * i + o * o;
        red += squares * term[0];
        green += squares * term[1];
        blue += squares * term[2];
    }
    const jb_real3 out = {f.x * jb_exp2(-red), f.y * jb_exp2(-green), f.z * jb_exp2(-blue)};
    return out;
}

#endif
