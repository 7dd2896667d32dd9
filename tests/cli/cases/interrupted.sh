# Ended early: no half pack, nothing left beside it, status 4.
texel bake "$ROOT/samples/bunny/bunny_closed.off" -o bunny.texel -r 400 --samples 8 2> talk.txt &
sleep 1
kill -TERM $!
wait $!
echo "status $?"
tail -n 1 talk.txt
rm talk.txt
ls -A
