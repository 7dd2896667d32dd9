cp "$DATA"/cube.* . && texel bake cube.obj -o cube.texel --recipe "$DATA/small.json" --slices x || exit
texel view cube.texel -o a.png --mode slices --level 2; echo $?
texel view cube.texel -o a.png --mode slices --axis z; echo $?
