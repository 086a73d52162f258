// JB_WIDTH queries at once: a jb_real holds one number of each. One text serves every width, and width 1 is plain floats.
//
// Arithmetic, comparisons and `condition ? a : b` mean the same for every width. Built-in functions are not used: where
// a driver's library was compiled for another processor than the kernel, each one is a call that saves all vector
// registers (PyPI's PoCL 3.0), and some crash at width 16.
#ifndef JB_VECTOR_CL
#define JB_VECTOR_CL

#pragma OPENCL FP_CONTRACT ON

// Everything is inlined: a call would save all vector registers, and hand vectors over in ways that drivers disagree on.
#define JB_INLINE static inline __attribute__((always_inline))

#define JB_JOIN_(a, b) a##b
#define JB_JOIN(a, b) JB_JOIN_(a, b)

#if JB_WIDTH == 1
typedef float jb_real;
typedef int jb_integer;
#define JB_AS_REAL(x) as_float(x)
#define JB_AS_INTEGER(x) as_int(x)
#else
typedef JB_JOIN(float, JB_WIDTH) jb_real;
typedef JB_JOIN(int, JB_WIDTH) jb_integer;
#define JB_AS_REAL(x) JB_JOIN(as_float, JB_WIDTH)(x)
#define JB_AS_INTEGER(x) JB_JOIN(as_int, JB_WIDTH)(x)
#endif

// One number for every query.
#define JB_REAL(x) ((jb_real)(x))

// A vector that may stand at any float's address.
typedef jb_real jb_real_anywhere __attribute__((aligned(4)));

// The queries' numbers one by one.
typedef union {
    jb_real all;
    float lane[JB_WIDTH];
} jb_lanes;

typedef union {
    jb_integer all;
    int lane[JB_WIDTH];
} jb_integer_lanes;

// A direction, or a colour, of every query.
typedef struct {
    jb_real x;
    jb_real y;
    jb_real z;
} jb_real3;

JB_INLINE jb_real jb_min(const jb_real a, const jb_real b) { return a < b ? a : b; }

JB_INLINE jb_real jb_max(const jb_real a, const jb_real b) { return a > b ? a : b; }

// x, but no more, or no less, than a bound; a NaN stays.
JB_INLINE jb_real jb_at_most(const jb_real x, const float bound) { return x > bound ? JB_REAL(bound) : x; }

JB_INLINE jb_real jb_at_least(const jb_real x, const float bound) { return x < bound ? JB_REAL(bound) : x; }

JB_INLINE jb_real jb_abs(const jb_real x) { return JB_AS_REAL(JB_AS_INTEGER(x) & 0x7fffffff); }

JB_INLINE jb_real jb_dot(const jb_real3 a, const jb_real3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

#endif
