// Directions, colours and places of JB_WIDTH queries, read from and written to arrays of `count`.
//
// Planar arrays hold all x, then all y, then all z. Interleaved ones hold x, y and z of the first query, then of the
// second. The last work item may have fewer queries than it has lanes: it repeats the last one, and writes what is there.
#ifndef JB_QUERIES_CL
#define JB_QUERIES_CL

#include "vector.cl"

// Numbers `first`, `first + 1`, ... of a planar array's part.
JB_INLINE jb_real jb_load(__global const float *part, const size_t first, const size_t count) {
    if (first + JB_WIDTH <= count) {
        return *(__global const jb_real_anywhere *)(part + first);
    }
    jb_lanes out;
    for (int k = 0; k < JB_WIDTH; ++k) {
        out.lane[k] = part[first + k < count ? first + k : count - 1];
    }
    return out.all;
}

JB_INLINE void jb_store(__global float *part, const size_t first, const size_t count, const jb_real value) {
    if (first + JB_WIDTH <= count) {
        *(__global jb_real_anywhere *)(part + first) = value;
        return;
    }
    const jb_lanes lanes = {value};
    for (int k = 0; first + k < count; ++k) {
        part[first + k] = lanes.lane[k];
    }
}

JB_INLINE jb_real3 jb_load_planar(__global const float *w, const size_t first, const size_t count) {
    const jb_real3 out = {
        jb_load(w, first, count), jb_load(w + count, first, count), jb_load(w + 2 * count, first, count)};
    return out;
}

JB_INLINE void jb_store_planar(__global float *f, const size_t first, const size_t count, const jb_real3 value) {
    jb_store(f, first, count, value.x);
    jb_store(f + count, first, count, value.y);
    jb_store(f + 2 * count, first, count, value.z);
}

JB_INLINE jb_real3 jb_load_interleaved(__global const float *w, const size_t first, const size_t count) {
    jb_lanes x, y, z;
    _Pragma("unroll") for (int k = 0; k < JB_WIDTH; ++k) {
        __global const float *at = w + 3 * (first + k < count ? first + k : count - 1);
        x.lane[k] = at[0];
        y.lane[k] = at[1];
        z.lane[k] = at[2];
    }
    const jb_real3 out = {x.all, y.all, z.all};
    return out;
}

JB_INLINE void jb_store_interleaved(__global float *f, const size_t first, const size_t count, const jb_real3 value) {
    const jb_lanes x = {value.x}, y = {value.y}, z = {value.z};
    _Pragma("unroll") for (int k = 0; k < JB_WIDTH; ++k) {
        if (first + k < count) {
            f[3 * (first + k)] = x.lane[k];
            f[3 * (first + k) + 1] = y.lane[k];
            f[3 * (first + k) + 2] = z.lane[k];
        }
    }
}

// `columns` numbers of each query.
JB_INLINE void jb_load_columns(
    __global const float *rows, const int columns, const size_t first, const size_t count, const uint is_interleaved,
    jb_real *out) {
    _Pragma("unroll") for (int c = 0; c < columns; ++c) {
        if (!is_interleaved) {
            out[c] = jb_load(rows + c * count, first, count);
            continue;
        }
        jb_lanes lanes;
        _Pragma("unroll") for (int k = 0; k < JB_WIDTH; ++k) {
            lanes.lane[k] = rows[columns * (first + k < count ? first + k : count - 1) + c];
        }
        out[c] = lanes.all;
    }
}

JB_INLINE jb_real3 jb_load_directions(__global const float *w, const size_t first, const size_t count, const uint is_interleaved) {
    return is_interleaved ? jb_load_interleaved(w, first, count) : jb_load_planar(w, first, count);
}

JB_INLINE void jb_store_colours(
    __global float *f, const size_t first, const size_t count, const uint is_interleaved, const jb_real3 value) {
    if (is_interleaved) {
        jb_store_interleaved(f, first, count, value);
    } else {
        jb_store_planar(f, first, count, value);
    }
}

#endif
