mkdir -p models/deep && for n in a b deep/c; do sed '/mtllib/d;/usemtl/d' "$DATA/cube.obj" > models/$n.obj; done && cp models/a.obj models/a.ply && echo nothing > models/bad.off
texel batch models -o packs -r 16 --want density; echo "status $?"
find packs -name volume.vdb | sort
rm models/bad.off && touch -d '2001-01-01' models/b.obj
texel batch models -o packs -r 16 --want density; echo "status $?"
# A pack that has lost a file is made again.
rm packs/b.texel/volume.vdb
texel batch models -o packs -r 16 --want density; echo "status $?"
