# A pack that cannot find its mesh takes it as a further argument; another mesh in its place is told by its hash.
mkdir far && cp "$DATA"/cube.* far && texel bake far/cube.obj -o cube.texel --recipe "$DATA/small.json" --want density || exit
texel view cube.texel -o before.png --truth --size 32x32 && mv far near || exit
texel view cube.texel -o after.png --truth --size 32x32; echo $?
texel bake --recipe cube.texel -o again.texel; echo $?
texel view cube.texel near/cube.obj -o after.png --truth --size 32x32 && cmp before.png after.png &&
texel bake --recipe cube.texel near/cube.obj -o again.texel && cmp cube.texel/volume.vdb again.texel/volume.vdb
echo '# another' >> near/cube.obj
texel view cube.texel near/cube.obj -o other.png --truth --size 32x32
