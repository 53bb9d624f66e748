MODULE small_board
  ! job: small-board.drl
  ! tool 1: drill 0.8
  ! tool 2: end mill 1
  ! at every stop: set Z again, or use tools of one length
  ! blank: at least 21.0 x 11.0 mm
  ! from zero: X 9.5 to 30.5, Y 4.5 to 15.5
  PERS tooldata pcb_tool:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  PERS wobjdata pcb_board:=[FALSE,TRUE,"",[[500,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  CONST orient down:=[0,1,0,0];
  CONST confdata free:=[0,0,0,0];
  CONST extjoint none:=[9E9,9E9,9E9,9E9,9E9,9E9];
  CONST speeddata quick:=[100,100,100,100];
  PROC main()
    ConfL \Off;
    spindle 0;
    spindle 0;
    MoveL [[0,0,20],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    TPWrite "Put in tool 1: drill 0.8";
    bit 1;
    Stop;
    spindle 30000;
    WaitTime 1.5;
    MoveL [[12.7,8.89,2],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[12.7,8.89,0.3],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[12.7,8.89,-2.1],down,free,none],[12,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    WaitTime 0.1;
    MoveL [[12.7,8.89,2],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[15.24,8.89,2],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[15.24,8.89,0.3],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[15.24,8.89,-1],down,free,none],[12,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[15.24,8.89,0.5],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[15.24,8.89,0.5],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[15.24,8.89,0.3],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[15.24,8.89,-2.1],down,free,none],[12,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[15.24,8.89,2],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    spindle 0;
    MoveL [[0,0,20],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    TPWrite "Put in tool 2: end mill 1";
    bit 2;
    Stop;
    spindle 24000;
    MoveL [[10,10,2],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[10,10,0.3],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    MoveL [[10,10,-0.1],down,free,none],[5,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20,10,-0.1],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveC [[23.5355,11.4645,-0.1],down,free,none],[[25,15,-0.1],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveC [[30,10,-0.1],down,free,none],[[25,5,-0.1],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveC [[21.4645,6.4645,-0.1],down,free,none],[[20,10,-0.1],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveC [[20.5,9.5,-0.1],down,free,none],[[21,10,-0.1],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveC [[20.5,10.5,-0.1],down,free,none],[[20,10,-0.1],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.0185,9.8651,-0.1087],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.0728,9.7402,-0.1174],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.1587,9.6346,-0.1261],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.27,9.5561,-0.1348],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.3983,9.5105,-0.1435],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.5341,9.5012,-0.1522],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.6674,9.5289,-0.1609],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.7883,9.5915,-0.1696],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.8879,9.6845,-0.1783],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.9586,9.8008,-0.187],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.9953,9.9319,-0.1957],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.9953,10.0681,-0.2043],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.9586,10.1992,-0.213],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.8879,10.3155,-0.2217],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.7883,10.4085,-0.2304],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.6674,10.4711,-0.2391],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.5341,10.4988,-0.2478],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.3983,10.4895,-0.2565],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.27,10.4439,-0.2652],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.1587,10.3654,-0.2739],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.0728,10.2598,-0.2826],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20.0185,10.1349,-0.2913],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[20,10,-0.3],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveC [[20.5,9.5,-0.3],down,free,none],[[21,10,-0.3],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveC [[20.5,10.5,-0.3],down,free,none],[[20,10,-0.3],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[10,10,-0.3],down,free,none],[10,100,100,100],fine,pcb_tool\WObj:=pcb_board;
    MoveL [[10,10,2],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
    spindle 0;
    MoveL [[0,0,20],down,free,none],quick,fine,pcb_tool\WObj:=pcb_board;
  ENDPROC
  PROC spindle(num rpm)
    ! your output for the spindle; its speed where it can be set
    IF rpm>0 THEN
      SetDO pcb_spindle,1;
    ELSE
      SetDO pcb_spindle,0;
    ENDIF
  ENDPROC
  PROC bit(num number)
    ! your magazine, where there is one
  ENDPROC
ENDMODULE
