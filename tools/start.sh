#!/bin/sh
# Everything from a bare Debian 12 to a baked sample: packages, build, `texel bake` of samples/pear.
set -eu
cd "$(dirname "$0")/.."
. tools/setup.sh
install_packages tools/packages.txt

cmake --preset release -DTEXEL_TESTS=OFF -DTEXEL_EXACT=OFF $(cache_options)
cmake --build --preset release
texel=build/release/bin/texel

pack=build/pear.texel
"$texel" bake samples/pear/pear.obj -o "$pack" --recipe samples/pear/recipe.json
"$texel" info "$pack"
echo
echo "The pack is $pack; look at $pack/preview.png. The program is $texel."
