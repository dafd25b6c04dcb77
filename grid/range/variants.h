/* SPDX-License-Identifier: MIT */
/*
 * variants - functions compiled once for each width of vectors and chosen at run time. Their loops go over blocks of a
 * constant number of elements, of which gcc and clang make vectors; each step rounds the same at any width, so all
 * copies give the same bits. Knows nothing of what they do.
 */
#ifndef SONARD_VARIANTS_H
#define SONARD_VARIANTS_H

#define INLINE static inline __attribute__((always_inline))

/* VARIANTS(static or nothing, type, name, (parameters), (arguments)) makes `name` of name_body, an INLINE function. */
#if defined(__x86_64__)
#define AVX512 "avx512f,avx512bw,avx512dq,avx512vl"
#define VARIANTS(linkage, type, name, parameters, arguments)                                                      \
    __attribute__((target(AVX512))) static type name##_avx512 parameters                                          \
    {                                                                                                             \
        return name##_body arguments;                                                                             \
    }                                                                                                             \
    __attribute__((target("avx2"))) static type name##_avx2 parameters                                            \
    {                                                                                                             \
        return name##_body arguments;                                                                             \
    }                                                                                                             \
    linkage type name parameters                                                                                  \
    {                                                                                                             \
        if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&                           \
            __builtin_cpu_supports("avx512vl"))                                                                   \
            return name##_avx512 arguments;                                                                       \
        if (__builtin_cpu_supports("avx2"))                                                                       \
            return name##_avx2 arguments;                                                                         \
        return name##_body arguments;                                                                             \
    }
#else
#define VARIANTS(linkage, type, name, parameters, arguments)                                                      \
    linkage type name parameters                                                                                  \
    {                                                                                                             \
        return name##_body arguments;                                                                             \
    }
#endif

#endif
