# Smaller volumes: within what was asked, whole, made again from their own recipe, and said by info.
bake() { texel bake "$DATA/cube.obj" -r 32 --samples 4 --want renderer "$@" 2>/dev/null; }
bake -o plain.texel
bake -o packed.texel --prune 0.004 --quantize 0.004 --codec zip
texel check packed.texel
texel compare packed.texel plain.texel --allow alpha_max=0.0041 --allow column_rms=0.007 --allow color_max=0.016 --allow area_relative=0.004 --allow volume_relative=0.004 > out.txt; echo $?
texel info packed.texel | grep -E "packed|prune_column"
texel info plain.texel | grep -c packed
python3 -c '
import glob, os
size = lambda pack: sum(os.path.getsize(f) for f in glob.glob(pack + "/*.vdb"))
print(size("packed.texel") < 0.95 * size("plain.texel"))'
texel bake --recipe packed.texel "$DATA/cube.obj" -o again.texel 2>/dev/null && cmp packed.texel/volume.vdb again.texel/volume.vdb && echo same
texel bake "$DATA/cube.obj" -o slices.texel -r 8 --want slices --prune 0.01 -v 2>&1 | grep -c -- "--prune, --quantize"
texel bake "$DATA/cube.obj" -o no.texel --prune 0.5; echo $?
texel bake "$DATA/cube.obj" -o no.texel --codec lzma; echo $?
