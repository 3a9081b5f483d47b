// SPDX-License-Identifier: BSD-3-Clause
#pragma once

/// Compiles a function once for each width of vectors and picks at the start of the program what
/// the machine has. Without fused products (-ffp-contract=off) all of them find the same bits.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define TRUEBOX_MANY_TARGETS \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
/// For the widest alone: to be called only where __builtin_cpu_supports("avx512f").
#define TRUEBOX_WIDE_VECTORS __attribute__((target("avx512f")))
#else
#define TRUEBOX_MANY_TARGETS
#endif
