# What has no meaning in a mode is refused, or, light for slices, said to change nothing.
cp "$DATA"/cube.* . && texel bake cube.obj -o cube.texel --recipe "$DATA/small.json" --want all || exit
texel view cube.texel -o a.png --axis x; echo $?
texel view cube.obj -o a.png --axis x; echo $?
texel view cube.texel -o a.png --level 1 --truth; echo $?
texel view cube.texel cube.obj -o a.png; echo $?
texel view cube.texel -o lit.png --size 16x16 --mode slices --light ambient:1,1,1 && texel view cube.texel -o plain.png --size 16x16 --mode slices --axis auto && cmp lit.png plain.png
ls *.png
