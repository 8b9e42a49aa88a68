#!/usr/bin/env bash
# Installs what Cairn needs on Debian 12 (bookworm); does nothing where all of it is there. As root or with sudo; asks
# nothing.
set -euo pipefail

packages=(
    # Tools.
    cmake ninja-build g++ ccache pkg-config clang-format clang-tidy
    # Films of `cairn render` and `cairn demo`.
    ffmpeg
    # Engine.
    libeigen3-dev libfcl-dev libccd-dev libtbb-dev libhwy-dev
    # Scene files, meshes and pictures.
    libassimp-dev libqhull-dev nlohmann-json3-dev libosmesa6-dev libpng-dev libcli11-dev
    # Tests and benchmarks.
    libgtest-dev libbenchmark-dev
    # Engines that are only measured against (cairn compare).
    libbullet-dev libode-dev libmujoco-dev
    # The pages that `cairn tune` and `cairn bench` write, opened by a test.
    chromium chromium-driver python3
)
# Kernels for NEON (scripts/check_neon.sh).
if [[ $(dpkg --print-architecture) != arm64 ]]; then
    packages+=(g++-aarch64-linux-gnu)
fi

missing=()
for package in "${packages[@]}"; do
    if [[ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" != installed ]]; then
        missing+=("$package")
    fi
done
if [[ ${#missing[@]} -eq 0 ]]; then
    exit 0
fi

root=()
if [[ $(id -u) -ne 0 ]]; then
    if ! command -v sudo >/dev/null; then
        echo "setup: run as root, or install sudo; missing: ${missing[*]}" >&2
        exit 1
    fi
    root=(sudo)
fi
echo "setup: installing ${missing[*]}" >&2
"${root[@]}" apt-get update -q </dev/null
"${root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -q -y --no-install-recommends "${missing[@]}" </dev/null
