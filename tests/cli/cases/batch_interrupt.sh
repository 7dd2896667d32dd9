mkdir models && for n in a b c d e f; do cp "$ROOT/samples/bunny/bunny_closed.off" models/$n.off; done
texel batch models -o packs -r 200 --samples 8 --want density --jobs 1 > first.txt 2> talk.txt &
batch=$!
for i in $(seq 300); do [ -e packs/a.texel/manifest.json ] && break; sleep 0.1; done
kill -INT $batch; wait $batch; echo "status $?"
tail -1 talk.txt
ls -A packs | grep -v "\.texel$"; grep -q "^baked" first.txt && echo some; grep -v "^baked" first.txt | grep -vc "^not begun"
texel batch models -o packs -r 200 --samples 8 --want density --jobs 1 > second.txt 2> /dev/null; echo "status $?"
grep -c '^up to date' second.txt > /dev/null && ls packs | wc -l
