mkdir lists && for n in a b; do sed '/mtllib/d;/usemtl/d' "$DATA/cube.obj" > lists/$n.obj; done
printf '# remarks and empty lines are passed over\n\na.obj\n[b]*.obj\na.obj\ngone.obj\n' > lists/all.txt
texel batch lists/all.txt -o packs -r 16 --want density --jobs 2 --report batch.json; echo "status $?"
grep -c '"input"' batch.json
texel batch 'none*.obj' -o packs; echo "status $?"
texel batch lists/a.obj -o packs/a.texel; echo "status $?"
texel batch -o packs; echo "status $?"
mkdir empty; texel batch empty -o packs; echo "status $?"
