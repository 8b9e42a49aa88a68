#!/usr/bin/env bash
# Compiles what goes through the vector unit for NEON, warnings as errors: on a PC nothing else would tell that a kernel
# no longer compiles for ARM.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
if [[ $(uname -m) == aarch64 ]]; then
    exit 0  # the build does
fi
room=$(mktemp -d)
trap 'rm -rf "$room"' EXIT
# By itself: the other headers of /usr/include are this machine's.
mkdir "$room/include"
ln -s /usr/include/hwy "$room/include/hwy"
mapfile -t kernels < <(grep -rl --include='*.cpp' 'foreach_target.h' base collision engine)
for kernel in "${kernels[@]}"; do
    aarch64-linux-gnu-g++ -std=c++20 -O2 -ffp-contract=off -Wall -Wextra -Werror -Wno-psabi -Iinclude -I. \
        -isystem "$room/include" -isystem /usr/include/eigen3 -c "$kernel" -o "$room/kernel.o"
    # Highway leaves out what it takes to be broken.
    if ! aarch64-linux-gnu-nm -C "$room/kernel.o" | grep N_NEON >/dev/null; then
        echo "check_neon: nothing of $kernel is for NEON" >&2
        exit 1
    fi
done
echo "check_neon: ${#kernels[@]} files compile for NEON"
