# Sourced by ./studio and ./check.sh: what has to be on the machine besides a Rust toolchain.

# need_packages run|test: installs the missing Debian/Ubuntu packages; elsewhere says what is needed.
need_packages() {
  local packages=(build-essential pkg-config libvulkan1 mesa-vulkan-drivers libx11-6 libx11-xcb1 libxcursor1 libxi6
    libxkbcommon0 libxkbcommon-x11-0)
  [ "$1" = test ] && packages+=(python3 python3-pip python3-venv)
  if ! command -v apt-get >/dev/null; then
    echo "not a Debian or Ubuntu machine: please see to a C linker, a Vulkan driver and the X11 or Wayland libraries" >&2
    return 0
  fi
  local missing=() package
  for package in "${packages[@]}"; do
    # A Python with pip from elsewhere serves as well as Debian's.
    case $package in
      python3 | python3-pip | python3-venv) python3 -m pip --version >/dev/null 2>&1 && python3 -c "import ensurepip" 2>/dev/null && continue ;;
    esac
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  echo "installing: ${missing[*]}" >&2
  local sudo=()
  [ "$(id -u)" = 0 ] || sudo=(sudo)
  "${sudo[@]}" apt-get update -qq
  DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2
}

if ! command -v cargo >/dev/null; then
  echo "Rust is missing: install Rust 1.95 or newer with rustup, then run this again" >&2
  exit 1
fi
