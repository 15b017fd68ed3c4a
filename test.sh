#!/usr/bin/env bash
# Runs every check of the project. It installs a software Vulkan driver and a virtual desktop for the window
# where they are missing. Where it may not install them, it skips the GPU tests or the tests of the window.
# The end of its output lists skipped tests.
set -euo pipefail
cd "$(dirname "$0")"

skipped=()
step="preparation"
# Skipped tests append their names to this file.
SDFC_SKIPPED_FILE=$(mktemp)
export SDFC_SKIPPED_FILE

finish() {
    local status=$?
    # A signal may end the script after a command that succeeded.
    [[ $status != 0 || -n ${is_complete:-} ]] || status=1
    [[ -z ${own_runtime_dir:-} ]] || rm -rf "$own_runtime_dir"
    local tests
    mapfile -t tests < <(sort -u "$SDFC_SKIPPED_FILE")
    rm -f "$SDFC_SKIPPED_FILE"
    echo
    if ((status == 0)); then
        echo "all checks passed in $SECONDS s"
    else
        echo "failed after $SECONDS s in $step (exit status $status)"
        skipped+=("all steps after $step")
    fi
    skipped+=("${tests[@]}")
    if ((${#skipped[@]} == 0)); then
        echo "skipped: nothing"
    else
        printf 'skipped: %s\n' "${skipped[@]}"
    fi
}
trap finish EXIT

# Runs a step: its name, and its command.
run() {
    step=$1
    shift
    echo
    echo "==> $step: $*"
    "$@"
}

# Reports whether the Vulkan loader is installed, and a driver that has a device.
has_vulkan() {
    find_loader && find_driver
}

find_loader() {
    local directory
    for directory in ${LD_LIBRARY_PATH:+${LD_LIBRARY_PATH//:/ }} /usr/lib /usr/lib64 /usr/lib/*-linux-gnu /usr/local/lib; do
        [[ ! -e $directory/libvulkan.so.1 ]] || return 0
    done
    return 1
}

find_driver() {
    local file
    # If one of these variables is set, the loader reads no other folder.
    local named=${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}}
    if [[ -n $named ]]; then
        for file in ${named//:/ }; do
            [[ ! -s $file ]] || return 0
        done
        return 1
    fi
    for file in {/usr/share,/usr/local/share,/etc,"${XDG_DATA_HOME:-$HOME/.local/share}"}/vulkan/icd.d/*.json; do
        [[ -e $file ]] || continue
        case $file in
        */lvp_icd.*) return 0 ;; # Mesa's software driver
        *) ! has_graphics_device || return 0 ;;
        esac
    done
    return 1
}

has_graphics_device() {
    local file
    for file in /dev/dri/renderD* /dev/nvidia[0-9]* /dev/dxg; do
        [[ ! -e $file ]] || return 0
    done
    return 1
}

# Installs packages, or sets `reason`. The first argument describes the missing part.
install() {
    local missing=$1 as_root=()
    shift
    if ! command -v apt-get >/dev/null; then
        reason="$missing, and there is no apt-get to install it"
        return 1
    fi
    if ((EUID != 0)); then
        if ! sudo -n true 2>/dev/null; then
            reason="$missing, and installing it takes root or sudo without a password"
            return 1
        fi
        as_root=(sudo -n)
    fi
    # If one source is unreachable, another one may have the packages.
    "${as_root[@]}" apt-get update -q || echo "warning: apt-get update failed"
    if ! "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get install -q -y --no-install-recommends "$@"; then
        reason="$missing, and apt-get could not install $*"
        return 1
    fi
}

# Installs software Vulkan, or sets `reason`.
install_vulkan() {
    install "no Vulkan driver is installed" mesa-vulkan-drivers libvulkan1 || return 1
    if ! has_vulkan; then
        reason="mesa-vulkan-drivers was installed, yet no Vulkan driver is found"
        return 1
    fi
}

# Reports whether the tests of the window can run. They need a virtual desktop, a simulated mouse, and the
# keyboard library that a window loads when it opens.
has_desktop() {
    local file
    command -v Xvfb >/dev/null && command -v xdotool >/dev/null || return 1
    for file in {/usr/lib,/usr/lib64,/usr/local/lib}{,/*-linux-gnu}/libxkbcommon-x11.so.0; do
        [[ ! -e $file ]] || return 0
    done
    return 1
}

# Installs the virtual desktop, or sets `reason`.
install_desktop() {
    install "no virtual desktop for the window is installed" xvfb xdotool \
        libx11-xcb1 libxcursor1 libxi6 libxkbcommon-x11-0 libxrandr2
}

# Prints the file of a second software driver, SwiftShader, which Chromium and Chrome include. Strict
# arithmetic is tested on it too. It is too large to be installed for that purpose alone.
find_second_device() {
    local file
    for file in /usr/lib*/chromium*/vk_swiftshader_icd.json /opt/google/chrome*/vk_swiftshader_icd.json \
        {/usr/share,/usr/local/share,/etc}/vulkan/icd.d/*swiftshader*.json; do
        if [[ -s $file ]]; then
            echo "$file"
            return 0
        fi
    done
    return 1
}

# Mesa prints a warning if this variable is not set.
if [[ -z ${XDG_RUNTIME_DIR:-} ]]; then
    own_runtime_dir=$(mktemp -d)
    export XDG_RUNTIME_DIR=$own_runtime_dir
fi

if [[ -n ${SDFC_SKIP_GPU:-} ]]; then
    skipped+=("GPU tests, by SDFC_SKIP_GPU: $SDFC_SKIP_GPU")
elif ! has_vulkan; then
    echo "==> no Vulkan driver is installed: installing software Vulkan"
    if ! install_vulkan; then
        echo "warning: $reason; the GPU tests will be skipped"
        export SDFC_SKIP_GPU=$reason
        skipped+=("GPU tests: $reason")
    fi
else
    echo "==> a Vulkan driver is installed"
fi

# Vulkan draws the window, too.
if [[ -n ${SDFC_SKIP_GPU:-} ]]; then
    export SDFC_SKIP_WINDOW=${SDFC_SKIP_WINDOW:-$SDFC_SKIP_GPU}
fi
if [[ -n ${SDFC_SKIP_WINDOW:-} ]]; then
    skipped+=("tests of the window: $SDFC_SKIP_WINDOW")
elif ! has_desktop; then
    echo "==> no virtual desktop for the window is installed: installing Xvfb and xdotool"
    if ! install_desktop; then
        echo "warning: $reason; the tests of the window will be skipped"
        export SDFC_SKIP_WINDOW=$reason
        skipped+=("tests of the window: $reason")
    fi
else
    echo "==> a virtual desktop for the window is installed"
fi

if [[ -n ${SDFC_SKIP_GPU:-} ]]; then
    unset SDFC_SECOND_DEVICE
elif [[ -n ${SDFC_SECOND_DEVICE:-} ]] || SDFC_SECOND_DEVICE=$(find_second_device); then
    export SDFC_SECOND_DEVICE
    echo "==> a second Vulkan driver is tested too: $SDFC_SECOND_DEVICE"
else
    unset SDFC_SECOND_DEVICE
    echo "==> no second Vulkan driver is installed (SwiftShader of Debian's chromium-common): one device is enough"
fi

run "format" cargo fmt --all --check
run "lints" cargo clippy --workspace --all-targets --locked -- -D warnings
run "tests" cargo test --workspace --locked
run "documentation" env RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --locked
is_complete=1
