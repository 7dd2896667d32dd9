texel bake "$DATA/cube.obj" -o cube.texel --recipe "$DATA/small.json" --want all --depfile cube.d --report report.json || exit
find cube.texel -type f | LC_ALL=C sort
cat cube.d
python3 -c "import json; r = json.load(open('report.json')); print(r['status'], ' '.join(r))"
texel check cube.texel
