cp "$DATA"/cube.* . && texel bake cube.obj -o cube.texel --recipe "$DATA/small.json" --want all || exit
for mode in volume slices truth; do texel view cube.texel -o $mode.png --mode $mode --size 32x24 || exit; done
texel view cube.obj -o mesh.png --size 32x24 --background 1,1,1 || exit
# Width and height stand in the header.
for picture in *.png; do printf '%s ' $picture; od -A n -t u1 -j 16 -N 8 $picture; done
